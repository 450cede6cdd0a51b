#include "realtime/realtime_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "files/assets.h"
#include "files/option_values.h"
#include "process/clock.h"
#include "process/thread_priority.h"
#include "realtime/picture_quality.h"
#include "sticks/predictors.h"

namespace app {
namespace {

constexpr std::string_view kTracePrefix = "trace:";
constexpr double kBetweenLapsS = 0.25;  // more than tracking::kGapS and any note's way beyond the last sample
constexpr double kLongestLiveS = 3 * 3600.0;  // as a trace that is played
constexpr double kLiveSpareS = 60;            // of a live source's only lap, beyond the run
constexpr double kSpareSoundS = 1;
constexpr double kStartS = 0.7;  // from starting the sensors to the epoch, at first
constexpr double kAheadS = 0.1;  // the epoch lies at least that far ahead when all is ready
constexpr int kStarts = 3;

void check(const RealtimeOptions& o) {
    if (o.sound.output_lead_s >= o.play.release_margin_s)
        refuse_options(fmt::format("--output-lead {} with a release margin of {}", o.sound.output_lead_s,
                                   o.play.release_margin_s),
                       "less than the release margin");
    if (o.play.solo)
        refuse_options("--solo with --realtime", "one of them: play the trace offline to hear one note");
    if (o.play.pedals && !o.sound.midi_input.empty())
        refuse_options("--pedals with --midi-in", "one of them");
    if (!o.play.audio && (!o.sound.midi_input.empty() || o.sound.output != audio::LiveOptions::Output::none))
        refuse_options("--output or --midi-in with --no-audio", "sound");
    if (!o.play.audio && !o.sound.midi_port.empty())
        refuse_options("--midi-out with --no-audio", "sound, whose clock times MIDI");
}

/// A trace that stands for the sticks of a live source, which has no samples yet.
PlayedTrace live_trace(const SensorOptions& sensors) {
    PlayedTrace trace;
    trace.file = trace.source = sensors.source;
    for (const std::string& name : sensors.sticks) trace.sticks.push_back({name, {{}, {}}});
    return trace;
}

/// The stage for each level of picture quality that is drawn differently.
std::vector<render::SceneDescription> scenes_of(const KitStage& stage, int width, int height) {
    std::vector<render::SceneDescription> scenes;
    for (const QualityLevel& level : quality_levels()) {
        if (level.rate_divisor > 1) continue;
        const auto smaller = [&](int side) {
            return std::max(1, (side + level.size_divisor - 1) / level.size_divisor);
        };
        scenes.push_back(stage.scene(smaller(width), smaller(height)));
        scenes.back().samples = level.samples;
        scenes.back().shadow_size = level.shadow_texels;
    }
    return scenes;
}

}  // namespace

RealtimeSession::RealtimeSession(const RealtimeOptions& asked) : options(asked), seconds(asked.seconds) {
    check(asked);
    const bool replayed = asked.sensors.source.starts_with(kTracePrefix);
    if (replayed) options.play.trace = find_trace(asked.sensors.source.substr(kTracePrefix.size()));
    live = !asked.sensors.source.empty() && !replayed;
    trace = live ? live_trace(asked.sensors) : read_played_trace(options.play.trace);
    kit = read_kit(asked.play.kit);
    stick = stick_geometry(trace, kit.stick, asked.play.tip, asked.play.shaft);
    contacts = contact_model(asked.play.sound_predictor);
    const double once_s = trace.t_end_s() - trace.t0_s();
    if (asked.play.pedals) moves = read_pedals(*asked.play.pedals, kit, trace.t0_s());
    if (!live) moves_left_out = leave_out(moves, trace.t0_s(), trace.t_end_s());
    if (seconds == 0) seconds = live ? kLongestLiveS : once_s;
    const double period_s = live ? seconds + kLiveSpareS : once_s + kBetweenLapsS;
    period_samples = static_cast<std::int64_t>(std::ceil(period_s * audio::kSampleRate));
}

void RealtimeSession::start(const OutputFolder& folder, DiskLog<float>& recording, const Warn& warn) {
    scratch = folder.scratch();
    const PlayOptions& o = options.play;
    stage.emplace(kit, trace.sticks.size(), stick, o.camera);
    // Worker processes and ZeroMQ's threads inherit it.
    simulation_priority = set_thread_priority(ThreadRole::simulation, options.realtime_priority);
    simulation = make_simulation(kit, o.workers);
    leave_thread_priority();
    if (o.audio) start_sound(recording);
    frames = start_frames(o, scenes_of(*stage, o.width, o.height), stage->frame({}, {}), folder,
                          FramePolicy::refuse, options.realtime_priority);
    if (sound && !sound->midi_problem().empty()) warn(sound->midi_problem());
    start_sensors();
}

void RealtimeSession::start_sound(DiskLog<float>& recording) {
    audio::LiveOptions o = options.sound;
    o.longest_s = seconds + kSpareSoundS;
    o.mix = mix_of(options.play, kit);
    o.take_sound = [&recording](std::span<const float> samples) { recording.append(samples); };
    // The audio thread and ALSA's get the same, and each says so.
    o.on_thread_start = [this, said = std::make_shared<std::once_flag>()] {
        const std::string priority = set_thread_priority(ThreadRole::sound, options.realtime_priority);
        std::call_once(*said, [&] { sound_priority = priority; });
    };
    sound = std::make_unique<audio::LivePerformance>(orchestra_file(), voices_of(kit), o);
}

/// Sensors have to know the epoch when they are started; where starting takes until then, they are started
/// once more with more time (of a live source, whose first samples then count from before the epoch, that
/// does no harm).
void RealtimeSession::start_sensors() {
    SensorOptions o = options.sensors;
    if (!live) o.source = "trace:" + options.play.trace.string();
    o.sticks.clear();
    for (const tracking::StickTrace& each : trace.sticks) o.sticks.push_back(each.name);
    o.predictors = stick_predictors(options.play.picture_predictor, options.play.sound_predictor,
                                    options.play.sound_lead_s, stick.shaft);
    o.period_s = period_s();
    o.realtime = options.realtime_priority;
    o.keep_learned = options.play.save_model.has_value();
    if (const ArtificialLoad::Part& stall = options.disturbance.stall; stall.amount > 0) {
        o.stall_at_s = stall.from_s;
        o.stall_s = stall.amount / 1e3;
    }
    double ahead_s = live ? 2 * kStartS : kStartS;
    for (int i = 1;; ++i, ahead_s *= 4) {
        o.epoch_ns = epoch_ns = monotonic_ns() + to_ns(ahead_s);
        sensors.reset();
        sensors = std::make_unique<SensorHub>(o);
        if (live || monotonic_ns() < epoch_ns - to_ns(kAheadS)) return;
        if (i == kStarts)
            throw std::runtime_error(fmt::format(
                "error: found sensors that took more than {:.1f} s to start, expected a machine less busy",
                ahead_s));
    }
}

std::vector<std::pair<std::string, std::string>> RealtimeSession::priorities() const {
    std::vector<std::pair<std::string, std::string>> all = {
        {"control", control_priority},
        {"simulation", options.play.workers > 0 ? simulation_priority : control_priority}};
    if (sound) all.emplace_back("sound", sound_priority);
    if (frames) all.emplace_back("drawing", frames->report().priority);
    return all;
}

}  // namespace app
