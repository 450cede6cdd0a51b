#include "realtime/play_realtime.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "play/play_run.h"
#include "realtime/realtime_run.h"
#include "report/json_document.h"
#include "sticks/learned_in_play.h"
#include "sticks/predictors.h"
#include "sticks/trace_warnings.h"

namespace app {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kEventKinds[] = {"silent",       "back",      "restarted", "ended", "clock jumped",
                                       "clocks apart", "malformed", "failed"};  // by SensorEvent::Kind
static_assert(std::size(kEventKinds) == static_cast<std::size_t>(SensorEvent::Kind::failed) + 1);

constexpr double kSameSpeed = 1e-6;  // relative: far below a step of MIDI or 24 bits
constexpr double kNextToS = 0.03;    // as notes are matched with contacts
constexpr double kEarlierS = 2;      // a delay acts on what follows: arming, bodies that still move
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// Age of the newest sample that a note could use: the onset of its strike, on the lap's clock, less the
/// sample's time.
double pose_age_s(const DiskLog<SampleTiming>& samples, const NoteTiming& note, const Strike& strike) {
    double newest_s = strike.scheduled_at_s;
    auto sample = std::ranges::upper_bound(samples, note.played.taken_ns, {}, &SampleTiming::handed_ns);
    while (sample != samples.begin() && (--sample)->lap == note.lap)
        if (sample->stick == strike.stick) {
            newest_s = std::max(newest_s, sample->t_s);
            break;
        }
    return strike.onset_s - newest_s;
}

/// The strikes of all laps on the run's clock; returns them on their laps' clocks. The sound decides which of
/// them were played, and when.
std::vector<LapStrikes> collect_strikes(RealtimeOutcome& outcome, std::vector<LapStrikes> laps,
                                        const RealtimeSession& session) {
    std::map<std::uint64_t, NoteTiming*> notes;
    for (NoteTiming& note : outcome.realtime.notes) notes[note.played.id] = &note;
    const auto place = [&](Strike& strike, std::int64_t sample) {
        strike.onset_sample = sample;
        strike.onset_s = outcome.play.t0_s + static_cast<double>(sample) / audio::kSampleRate;
    };
    for (LapStrikes& lap : laps) {
        const std::int64_t shift = static_cast<std::int64_t>(lap.lap) * session.period_samples;
        const double shift_s = static_cast<double>(lap.lap) * session.period_s();
        for (Strike& strike : lap.strikes) {
            strike.id += lap.first_id;
            const auto found = notes.find(strike.id);
            if (session.sound) strike.outcome = found == notes.end() ? Outcome::cancelled : Outcome::released;
            if (found != notes.end()) {
                NoteTiming& note = *found->second;
                place(strike, note.played.onset_sample - shift);
                note.strike = outcome.play.strikes.size();
                note.lap = lap.lap;
                note.pose_age_s = pose_age_s(outcome.realtime.samples, note, strike);
            }
            Strike& shifted = outcome.play.strikes.emplace_back(strike);
            place(shifted, strike.onset_sample + shift);
            for (double* t : {&shifted.contact_s, &shifted.scheduled_at_s, &shifted.decided_at_s})
                *t += shift_s;
        }
    }
    return laps;
}

/// The recorded paths on the run's clock: the trace lap by lap, or what a live source gave.
std::vector<TipTrack> tracks_of(const RealtimeSession& session, const RealtimeRun& run) {
    tracking::Trace trace = session.trace;
    const double t0_s = trace.t0_s(), end_s = t0_s + run.end_s();
    const double period_s = session.period_s();
    for (std::size_t i = 0; i < trace.sticks.size(); ++i) {
        std::vector<tracking::PoseSample> samples;
        if (session.live) {
            samples.assign(run.seen()[i].begin(), run.seen()[i].end());
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

std::string failure_of(const std::vector<SensorEvent>& events) {
    std::string failure;
    for (const SensorEvent& event : events)
        if (event.kind == SensorEvent::Kind::failed) failure = event.message;
    return failure;
}

/// Warns of each stick without a sample. A run that was interrupted before it began, or a live run without any
/// sample, has nothing to show: that is an error.
void check_samples(const RealtimeSession& session, const RealtimeRun& run, const Warn& warn) {
    if (run.end_s() <= 0) throw std::runtime_error("error: interrupted before anything was played");
    const auto silent = [](const auto& samples) { return samples.empty(); };
    if (session.live && std::ranges::all_of(run.seen(), silent)) {
        const std::string failure = failure_of(run.events());
        throw std::runtime_error(
            failure.empty() ? fmt::format("error: no sample came from {} in {:.1f} s; nothing was written",
                                          session.options.sensors.source, run.end_s())
                            : failure);
    }
    for (std::size_t i = 0; i < session.trace.sticks.size(); ++i)
        if (silent(run.seen()[i]))
            warn(fmt::format("stick {}: no sample in {:.1f} s", session.trace.sticks[i].name, run.end_s()));
}

/// A filter that was started again comes near to one that was not, but never to the last bit.
bool same_speed(const Strike& a, const Strike& b) {
    return std::abs(a.speed_mps - b.speed_mps) <= kSameSpeed * b.speed_mps;
}

/// The strike of the same stick and instrument next to an offline one.
std::vector<const Strike*>::iterator nearest(std::vector<const Strike*>& strikes, const Strike& offline) {
    auto best = strikes.end();
    double least = kNextToS;
    for (auto other = strikes.begin(); other != strikes.end(); ++other) {
        if ((*other)->stick != offline.stick || (*other)->instrument != offline.instrument) continue;
        const double apart = std::abs((*other)->onset_s - offline.onset_s);
        if (apart <= least) least = apart, best = other;
    }
    return best;
}

/// Finds the cause of a divergence of `strike` in a lap; what was played until `end_s` of its clock was fixed.
void explain(Divergence& divergence, const Strike& strike, const RealtimeResult& realtime, double end_s) {
    const double from_s = strike.scheduled_at_s - kEarlierS, to_s = strike.onset_s;
    std::map<std::uint32_t, double> before_s;  // the sample before, by stick
    for (const SampleTiming& sample : realtime.samples) {
        if (sample.lap != divergence.lap) continue;
        // What was skipped lies before the sample that came instead.
        const auto [before, first] = before_s.try_emplace(sample.stick, sample.t_s);
        const double begin_s = sample.skipped > 0 ? before->second : sample.t_s;
        before->second = sample.t_s;
        if (sample.t_s < from_s || begin_s > to_s || (sample.late_s <= 0 && sample.skipped == 0)) continue;
        // How late the sample was with the sound, whatever else held it up.
        const double delay_s = static_cast<double>(sample.handed_ns - sample.due_ns) / 1e9;
        if (delay_s <= divergence.delay_s) continue;
        divergence.delay_s = delay_s;
        divergence.cause = sample.skipped > 0 ? "samples skipped" : "sample late";
    }
    if (divergence.delay_s == 0 && strike.onset_s > end_s) divergence.cause = "the run ended";
}

/// Plays the session's trace offline (no frames, no sound, in this process): each strike of each lap, on the
/// lap's clock, against the offline strike of the same stick and instrument next to it (30 ms). Equal: the same
/// outcome, the same onset to the sample and the same speed (within a millionth). A difference is explained by
/// the greatest delay met by samples of any stick (the bodies are common to all) between two seconds before the
/// strike was first predicted and its decision: samples whose notes were handed over too late to change all the sound
/// (late_s > 0), or were never seen; or by the end of the run within its lap.
OfflineComparison compare_with_offline(const std::vector<LapStrikes>& laps, const RealtimeResult& realtime,
                                       const RealtimeSession& session) {
    const std::vector<Strike> offline =
        offline_strikes(session.trace, session.kit, session.options.play, session.stick, session.moves);
    OfflineComparison result;
    for (std::uint64_t lap = 0; lap < realtime.laps; ++lap) {
        const double end_s =
            session.trace.t0_s() + realtime.seconds - static_cast<double>(lap) * realtime.period_s;
        const auto add = [&](const Strike& strike, const char* what, double offline_s, double here_s) {
            result.departures.push_back(
                {lap, strike.stick, strike.instrument, what, offline_s, here_s, 0, "unexplained"});
            explain(result.departures.back(), strike, realtime,
                    end_s - session.options.play.release_margin_s);
        };
        std::vector<const Strike*> own;  // played here, and not matched yet
        for (const LapStrikes& those : laps)
            for (const Strike& strike : those.strikes)
                if (those.lap == lap && strike.outcome == Outcome::released) own.push_back(&strike);
        for (const Strike& strike : offline) {
            // What lies beyond the run's end could not be.
            if (strike.outcome != Outcome::released || strike.scheduled_at_s > end_s) continue;
            ++result.offline_strikes;
            const auto match = nearest(own, strike);
            if (match == own.end()) {
                add(strike, "not sounded", strike.onset_s, kNone);
                continue;
            }
            const Strike& here = **match;
            own.erase(match);
            if (here.onset_sample != strike.onset_sample)
                add(strike, "another onset", strike.onset_s, here.onset_s);
            else if (!same_speed(here, strike))
                add(strike, "another speed", strike.onset_s, here.onset_s);
        }
        for (const Strike* strike : own) add(*strike, "sounded only here", kNone, strike->onset_s);
    }
    return result;
}

/// What the finished run gave, on the run's clock.
void collect(RealtimeOutcome& outcome, const RealtimeSession& session, RealtimeRun& run,
             const OutputFolder& folder) {
    PlayResult& result = outcome.play;
    if (session.sound) finish_sound(*session.sound, run.end_s(), result, session.kit, folder);
    outcome.realtime = run.finish();
    outcome.failure = failure_of(outcome.realtime.events);
    result.samples_refused = run.refused();
    result.pedals = run.pedals();
    result.pedal_moves_left_out = session.moves_left_out;
    result.frames = outcome.realtime.frames.size();
    result.t_end_s = result.t0_s + run.end_s();
    result.tracks = tracks_of(session, run);
    const std::vector<LapStrikes> laps = collect_strikes(outcome, run.laps(), session);
    if (session.frames) fill_gaps(folder.path("frames"), result.frames, session.frames->report().rest_image);
    const PlayOptions& o = session.options.play;
    // A program of one's own that has failed would fail again.
    const bool external = is_external(o.picture_predictor) || is_external(o.sound_predictor);
    if (!session.live && !(external && !outcome.failure.empty()))
        outcome.offline = compare_with_offline(laps, outcome.realtime, session);
}

Json quality_json(const RealtimeResult& r) {
    Json changes = Json::array();
    for (const LeadStep& step : r.leads)
        if (step.change >= 0)
            changes.push_back({{"at_s", step.at_s}, {"level", step.quality}, {"why", r.why(step)}});
    return {{"levels", r.quality_levels},
            {"first", r.leads.empty() ? Json() : Json(r.leads.front().quality)},
            {"last", r.leads.empty() ? Json() : Json(r.leads.back().quality)},
            {"changes", changes}};
}

/// The object `realtime` of summary.json.
Json summary_of(const RealtimeOutcome& o) {
    const RealtimeResult& r = o.realtime;
    const LatencyReport& l = o.latency;
    Json priorities = Json::object(), events = Json::array();
    for (const auto& [thread, obtained] : r.priorities) priorities[thread] = obtained;
    for (const SensorEvent& event : r.events)
        events.push_back({{"at_s", event.at_s},
                          {"kind", kEventKinds[static_cast<std::size_t>(event.kind)]},
                          {"message", event.message}});
    return {{"seconds", r.seconds},
            {"laps", r.laps},
            {"period_s", r.period_s},
            {"output_lead_s", r.output_lead_s},
            {"frames",
             {{"total", l.frames.total},
              {"missed", l.frames.missed},
              {"late", l.frames_late},
              {"skipped", l.frames_skipped},
              {"left_out_by_rate", l.frames_left_out},
              {"not_written", r.frames_not_written}}},
            {"notes",
             {{"total", l.notes.total},
              {"late", l.notes.missed},
              {"changes_refused", r.refused_changes},
              {"queue_overflows", r.queue_overflows}}},
            {"against_offline",
             {{"offline_strikes", o.offline.offline_strikes},
              {"departures", o.offline.departures.size()},
              {"unexplained", o.offline.unexplained()}}},
            {"quality", quality_json(r)},
            {"sensors", {{"clocks", clock_table(o.play, r).json()}, {"events", events}}},
            {"priorities", priorities},
            {"disturbed_by", r.disturbed_by},
            {"audio_device", r.audio_device},
            {"device_delay_s", r.device_delay_s},
            {"device_underruns", r.device_underruns},
            {"device_corrections", r.device_corrections},
            {"midi_late", r.midi_late},
            {"midi_lost", r.midi_lost}};
}

Table departure_table(const RealtimeOutcome& o) {
    Table table =
        Table::of({"lap", "stick", "instrument", "what", "offline_onset_s", "onset_s", "cause", "delay_ms"});
    for (const Divergence& d : o.offline.departures)
        table.add({d.lap, o.play.sticks[d.stick], o.play.instruments[d.instrument], d.what, d.offline_onset_s,
                   d.onset_s, d.cause, fmt::format("{:.3f}", 1e3 * d.delay_s)});
    return table;
}

/// Measures the latency of a run whose strikes are scored and writes what a run in real time has beside the
/// products of play().
void write_measurements(RealtimeOutcome& o, const RealtimeSession& session, OutputFolder& folder) {
    o.latency = latency_report(o.play, o.realtime, session.kit, session.stick.radius_m);
    write_file(folder.path("departures.csv"), departure_table(o).csv());
    for (const auto& [name, table] : latency_rows(o.latency, o.play, o.realtime))
        write_file(folder.path(name), table().csv());
    write_file(folder.path("latency.json"), format_latency_json(o.latency, o.play, o.realtime));
    write_page(folder, "latency.html",
               [&](Plotter& plotter) { return format_latency_page(o.latency, o.play, o.realtime, plotter); });
}

}  // namespace

RealtimeOutcome play_realtime(const RealtimeOptions& options, const Warn& warn) {
    const WallTimer wall;
    require_tools(options.play);
    std::optional<OutputFolder> folder;  // outlives the threads that write into it
    RealtimeOutcome outcome;             // outlives the session, which writes into it
    RealtimeSession session(options);
    outcome.play = describe(session.options.play, session.trace, session.kit);
    std::optional<LearnedModel> learned;
    if (const auto& file = session.options.play.save_model)
        learned.emplace(LearnedInPlay{*file, "play --realtime", outcome.play.options.picture_predictor,
                                      session.live ? session.options.sensors.source : outcome.play.trace});
    folder.emplace(options.play.out);
    outcome.play.sound.samples = DiskLog<float>(folder->scratch());
    session.start(*folder, outcome.play.sound.samples, warn);
    if (!session.live) warn_of_units(session.trace);  // now that nothing is left to be refused
    outcome.play.stages_s.emplace_back("start", wall.seconds());
    {
        RealtimeRun run(session);
        run.run(warn);
        check_samples(session, run, warn);
        collect(outcome, session, run, *folder);
    }
    write_products(outcome.play,
                   {session.kit, session.stick, *session.simulation, session.frames.get(), wall}, *folder,
                   [&] {
                       write_measurements(outcome, session, *folder);
                       return json_document(summary_of(outcome));
                   });
    if (learned) {
        const LearnedBySticks taught = session.sensors->end_and_take_learned();
        learned->save_or_say(taught.experiences, taught.silent, outcome.play.failures);
    }
    return outcome;
}

}  // namespace app
