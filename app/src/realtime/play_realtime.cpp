#include "realtime/play_realtime.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "files/output_folder.h"
#include "kit/tip_track.h"
#include "play/play_products.h"
#include "play/play_setup.h"
#include "process/clock.h"
#include "process/progress_bar.h"
#include "process/stop_signals.h"
#include "process/thread_priority.h"
#include "realtime/divergence.h"
#include "realtime/realtime_products.h"
#include "realtime/realtime_session.h"
#include "sticks/predictors.h"

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr double kStartS = 0.7;  // from starting the sensors to the epoch, at first
constexpr double kAheadS = 0.1;  // the epoch lies at least that far ahead when all is ready
constexpr int kStarts = 3;

/// Sensors have to know the epoch when they are started; where starting takes until then, they are started
/// once more with more time (of a live source, whose first samples then count from before the epoch, that
/// does no harm).
std::unique_ptr<SensorHub> start_sensors(const RealtimeSession& session, std::int64_t& epoch_ns) {
    double ahead_s = session.live ? 2 * kStartS : kStartS;
    for (int i = 1;; ++i, ahead_s *= 4) {
        epoch_ns = monotonic_ns() + to_ns(ahead_s);
        auto hub = std::make_unique<SensorHub>(sensors_of(session, epoch_ns));
        if (session.live || monotonic_ns() < epoch_ns - to_ns(kAheadS)) return hub;
        if (i == kStarts)
            throw std::runtime_error(fmt::format(
                "error: found sensors that took more than {:.1f} s to start, expected a machine less busy",
                ahead_s));
    }
}

/// The strikes of all laps, on their laps' clocks and on the run's. The sound decides which of them were played,
/// and when.
void collect_strikes(RealtimeOutcome& outcome, std::vector<LapStrikes>& laps, std::int64_t period_samples,
                     bool sound) {
    std::map<std::uint64_t, const audio::PlayedNote*> played;
    for (const NoteTiming& note : outcome.realtime.notes) played[note.played.id] = &note.played;
    const double period_s = outcome.realtime.period_s;
    for (LapStrikes& lap : laps)
        for (Strike& strike : lap.strikes) {
            strike.id += lap.first_id;
            const auto note = played.find(strike.id);
            if (sound) strike.outcome = note == played.end() ? Outcome::cancelled : Outcome::released;
            if (note != played.end()) {
                strike.onset_sample =
                    note->second->onset_sample - static_cast<std::int64_t>(lap.lap) * period_samples;
                strike.onset_s =
                    outcome.play.t0_s + static_cast<double>(strike.onset_sample) / audio::kSampleRate;
            }
            outcome.lap_strikes.push_back(strike);
            const double shift_s = static_cast<double>(lap.lap) * period_s;
            strike.onset_sample += static_cast<std::int64_t>(lap.lap) * period_samples;
            strike.onset_s =
                outcome.play.t0_s + static_cast<double>(strike.onset_sample) / audio::kSampleRate;
            for (double* t : {&strike.contact_s, &strike.scheduled_at_s, &strike.decided_at_s}) *t += shift_s;
            outcome.play.strikes.push_back(strike);
        }
    for (NoteTiming& note : outcome.realtime.notes) {
        note.strike = static_cast<std::size_t>(note.played.id - 1);
        const auto lap = std::ranges::find_if(laps, [&](const LapStrikes& l) {
            return note.played.id > l.first_id && note.played.id <= l.first_id + l.strikes.size();
        });
        note.lap = lap == laps.end() ? 0 : lap->lap;
    }
}

/// Age of the newest sample that a note could use: its onset less the sample's time.
void age_notes(RealtimeOutcome& outcome) {
    const std::vector<SampleTiming>& samples = outcome.realtime.samples;  // by time of their hand-over
    for (NoteTiming& note : outcome.realtime.notes) {
        const Strike& strike = outcome.lap_strikes[note.strike];
        double newest_s = strike.scheduled_at_s;
        auto sample = std::ranges::upper_bound(samples, note.played.taken_ns, {}, &SampleTiming::handed_ns);
        while (sample != samples.begin() && (--sample)->lap == note.lap)
            if (sample->stick == strike.stick) {
                newest_s = std::max(newest_s, sample->t_s);
                break;
            }
        note.pose_age_s = strike.onset_s - newest_s;
    }
}

/// The recorded paths on the run's clock: the trace lap by lap, or what a live source gave.
std::vector<TipTrack> tracks_of(const RealtimeSession& session, const RealtimeRun& run) {
    tracking::Trace trace = session.trace;
    const double t0_s = trace.t0_s(), end_s = t0_s + run.end_s();
    const double period_s = static_cast<double>(session.period_samples) / audio::kSampleRate;
    for (std::size_t i = 0; i < trace.sticks.size(); ++i) {
        std::vector<tracking::PoseSample> samples;
        if (session.live) {
            samples = run.seen()[i];
        } else {
            for (std::uint64_t lap = 0; static_cast<double>(lap) * period_s < run.end_s(); ++lap)
                for (tracking::PoseSample sample : session.trace.sticks[i].samples) {
                    sample.t_s += static_cast<double>(lap) * period_s;
                    if (sample.t_s <= end_s) samples.push_back(sample);
                }
        }
        trace.sticks[i].samples = std::move(samples);
    }
    return tip_tracks(trace, session.stick);
}

/// What stayed on the screen instead of a frame that is not there: the frame before; before the first, the
/// stage at rest.
void fill_gaps(const fs::path& folder, std::size_t frames, const render::Image& rest) {
    fs::path last;
    for (std::size_t k = 0; k < frames; ++k) {
        const fs::path file = folder / fmt::format("{:06}.png", k);
        if (!fs::exists(file)) {
            std::error_code no_links;
            if (last.empty())
                write_file(file, render::encode_png(rest));
            else if (fs::create_hard_link(last, file, no_links); no_links)
                fs::copy_file(last, file);
        }
        last = file;
    }
}

/// Everything that plays, made before the run's clock starts.
struct Players {
    Players(const RealtimeSession& session, const OutputFolder& folder)
        : stage(session.kit, session.trace.sticks.size(), session.stick) {
        const RealtimeOptions& options = session.options;
        // Worker processes and ZeroMQ's threads inherit it.
        simulation_priority = set_thread_priority(ThreadRole::simulation, options.realtime_priority);
        simulation = make_simulation(session.kit, options.play.workers);
        leave_thread_priority();
        if (options.play.audio) sound = make_live_sound(session, sound_priority);
        frames = start_frames(options.play, scenes_of(stage, options.play.width, options.play.height),
                              stage.frame({}, {}), folder, FramePolicy::refuse, options.realtime_priority);
    }
    Players(const Players&) = delete;
    Players& operator=(const Players&) = delete;

    KitStage stage;
    std::string simulation_priority, sound_priority, control_priority;
    std::unique_ptr<sim::Simulation> simulation;
    std::unique_ptr<audio::LivePerformance> sound;  ///< absent with --no-audio
    std::unique_ptr<FrameThread> frames;            ///< absent with --no-frames
};

std::vector<std::pair<std::string, std::string>> priorities_of(const Players& players, int workers) {
    std::vector<std::pair<std::string, std::string>> all = {
        {"control", players.control_priority},
        {"simulation", workers > 0 ? players.simulation_priority : players.control_priority}};
    if (players.sound) all.emplace_back("sound", players.sound_priority);
    if (players.frames) all.emplace_back("drawing", players.frames->priority());
    return all;
}

/// The loop, from samples to notes and frames.
void play_through(RealtimeRun& run, const RealtimeSession& session, Players& players, std::int64_t epoch_ns,
                  const std::function<void(const std::string&)>& warn) {
    const RealtimeOptions& options = session.options;
    if (players.sound) players.sound->start(epoch_ns);
    const BusyThreads load(options.disturbance, epoch_ns);
    players.control_priority = set_thread_priority(ThreadRole::control, options.realtime_priority);
    ProgressBar bar(options.play.progress);
    const StopSignals signals;
    run.run(
        session.seconds, [] { return StopSignals::stopped(); }, warn, [&](double done) { bar.show(done); });
    bar.clear();
    leave_thread_priority();
    if (run.end_s() <= 0) throw std::runtime_error("error: interrupted before anything was played");
}

std::string failure_of(const RealtimeResult& realtime) {
    std::string failure;
    for (const SensorEvent& event : realtime.events)
        if (event.kind == SensorEvent::Kind::failed) failure = event.message;
    return failure;
}

/// Warns of each stick without a sample. A live run without any sample has nothing to show: that is an error.
void check_samples(const RealtimeSession& session, RealtimeRun& run,
                   const std::function<void(const std::string&)>& warn) {
    const auto silent = [](const auto& samples) { return samples.empty(); };
    if (session.live && std::ranges::all_of(run.seen(), silent)) {
        const std::string failure = failure_of(run.result());
        throw std::runtime_error(
            failure.empty() ? fmt::format("error: no sample came from {} in {:.1f} s; nothing was written",
                                          session.options.source, run.end_s())
                            : failure);
    }
    for (std::size_t i = 0; i < session.trace.sticks.size(); ++i)
        if (silent(run.seen()[i]))
            warn(fmt::format("stick {}: no sample in {:.1f} s", session.trace.sticks[i].name, run.end_s()));
}

void take_sound(audio::LivePerformance& sound, RealtimeOutcome& outcome, const OutputFolder& folder,
                std::int64_t epoch_ns) {
    RealtimeResult& result = outcome.realtime;
    finish_sound(sound, result.seconds, outcome.play, folder);
    for (const audio::PlayedNote& played : sound.take_played()) {
        NoteTiming note;
        note.played = played;
        note.late_s = static_cast<double>(played.onset_sample - played.planned_sample) / audio::kSampleRate;
        result.notes.push_back(note);
    }
    for (NoteTiming& note : result.notes) {
        note.played.taken_ns -= epoch_ns;
        if (note.played.midi_sent_ns != 0) note.played.midi_sent_ns -= epoch_ns;
    }
    for (audio::BlockTiming block : sound.blocks()) {
        block.planned_ns -= epoch_ns, block.started_ns -= epoch_ns, block.done_ns -= epoch_ns;
        result.blocks.push_back(block);
    }
    result.audio_device = sound.device();
    result.refused_changes = sound.refused_changes();
    result.queue_overflows = sound.queue_overflows();
    result.device_underruns = sound.device_underruns();
    result.device_corrections = sound.device_corrections();
    result.midi_late = sound.late_strokes();
    result.midi_lost = sound.lost_strokes();
}

/// What the finished run gave, on the run's clock.
void collect(RealtimeOutcome& outcome, RealtimeSession& session, RealtimeRun& run, Players& players,
             const OutputFolder& folder, std::int64_t epoch_ns) {
    if (players.frames) run.finish_frames();
    outcome.realtime = std::move(run.result());
    outcome.realtime.disturbed_by = session.options.disturbed_by;
    outcome.realtime.priorities = priorities_of(players, session.options.play.workers);
    outcome.failure = failure_of(outcome.realtime);
    if (players.sound) take_sound(*players.sound, outcome, folder, epoch_ns);
    outcome.stick = session.stick = run.geometry();
    PlayResult& result = outcome.play;
    result.samples_refused = run.refused();
    result.frames = outcome.realtime.frames.size();
    result.t_end_s = result.t0_s + run.end_s();
    result.tracks = tracks_of(session, run);
    collect_strikes(outcome, run.laps(), session.period_samples, players.sound != nullptr);
    age_notes(outcome);
    if (players.frames) fill_gaps(folder.path("frames"), result.frames, players.frames->rest_image());
}

}  // namespace

RealtimeOutcome play_realtime(const RealtimeOptions& options,
                              const std::function<void(const std::string&)>& warn) {
    const WallTimer wall;
    RealtimeSession session = open_session(options);
    RealtimeOutcome outcome;
    outcome.play = describe(session.options.play, session.trace, session.kit, !session.live);
    outcome.kit = session.kit;
    outcome.stick = session.stick;
    OutputFolder folder(options.play.out);
    Players players(session, folder);
    if (players.sound && !players.sound->midi_problem().empty()) warn(players.sound->midi_problem());
    std::int64_t epoch_ns = 0;
    const std::unique_ptr<SensorHub> sensors = start_sensors(session, epoch_ns);
    outcome.play.stages_s.emplace_back("start", wall.seconds());
    {
        RealtimeRun run(
            session.kit, session.options, session.stick, session.trace.t0_s(), session.period_samples,
            {*players.simulation, players.stage, *sensors, players.sound.get(), players.frames.get()},
            session.trace.sticks.size(), epoch_ns);
        play_through(run, session, players, epoch_ns, warn);
        check_samples(session, run, warn);
        collect(outcome, session, run, players, folder, epoch_ns);
    }
    outcome.realtime.clocks = sensors->clocks();
    // A program of one's own that has failed would fail again.
    const bool external =
        is_external(options.play.picture_predictor) || is_external(options.play.sound_predictor);
    if (!session.live && !(external && !outcome.failure.empty()))
        find_departures(outcome, session.trace, session.options.play);
    const RunParts parts{session.options.play, session.kit,          session.stick,
                         *players.simulation,  players.frames.get(), wall};
    write_products(outcome.play, parts, folder, [&] { return write_realtime_products(outcome, folder); });
    return outcome;
}

}  // namespace app
