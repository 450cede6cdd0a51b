#include "realtime/realtime_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "files/assets.h"
#include "files/bad_input.h"
#include "play/play_setup.h"
#include "process/thread_priority.h"

namespace app {
namespace {

constexpr std::string_view kTracePrefix = "trace:";
constexpr double kBetweenLapsS = 0.25;  // more than tracking::kGapS and any note's way beyond the last sample
constexpr double kLongestLiveS = 600;   // 23 MB of sound a minute are kept
constexpr double kSpareSoundS = 1;

void refuse(bool wrong, const std::string& found, const std::string& expected) {
    if (wrong) throw BadInput(fmt::format("error: found {}, expected {}", found, expected));
}

void check(const RealtimeOptions& o) {
    refuse(
        o.output_lead_s >= o.play.release_margin_s,
        fmt::format("--output-lead {} with a release margin of {}", o.output_lead_s, o.play.release_margin_s),
        "less than the release margin");
    refuse(o.play.solo.has_value(), "--solo with --realtime",
           "one of them: play the trace offline to hear one note");
    refuse(!o.play.audio && !o.midi_port.empty(), "--midi-out with --no-audio",
           "sound, whose clock times MIDI");
}

/// A trace that stands for the sticks of a live source, which has no samples yet.
tracking::Trace live_trace(const RealtimeOptions& options) {
    tracking::Trace trace;
    trace.file = trace.source = options.source;
    for (const std::string& name : options.sticks) trace.sticks.push_back({name, {{}, {}}});
    return trace;
}

}  // namespace

RealtimeSession open_session(const RealtimeOptions& options) {
    check(options);
    RealtimeSession session{options, {}, {}, {}, is_live(options), options.seconds, 0};
    if (options.source.starts_with(kTracePrefix))
        session.options.play.trace = find_trace(options.source.substr(kTracePrefix.size()));
    session.trace = session.live ? live_trace(options) : read_played_trace(session.options.play.trace);
    session.kit = read_kit(options.play.kit);
    session.stick = stick_geometry(session.trace, session.kit.stick, options.play.tip, options.play.shaft);
    const double once_s = session.trace.t_end_s() - session.trace.t0_s();
    if (session.live) {
        if (session.seconds == 0) session.seconds = kLongestLiveS;
        session.period_samples =
            static_cast<std::int64_t>(std::ceil((session.seconds + 60) * audio::kSampleRate));
        return session;
    }
    if (session.seconds == 0) session.seconds = once_s;
    session.period_samples =
        static_cast<std::int64_t>(std::ceil((once_s + kBetweenLapsS) * audio::kSampleRate));
    return session;
}

SensorOptions sensors_of(const RealtimeSession& session, std::int64_t epoch_ns) {
    SensorOptions sensors;
    const RealtimeOptions& o = session.options;
    sensors.source = session.live ? o.source : "trace:" + o.play.trace.string();
    for (const tracking::StickTrace& stick : session.trace.sticks) sensors.sticks.push_back(stick.name);
    sensors.predictors =
        stick_predictors(o.play.picture_predictor, o.play.sound_predictor, o.play.sound_lead_s);
    sensors.epoch_ns = epoch_ns;
    sensors.period_s = static_cast<double>(session.period_samples) / audio::kSampleRate;
    sensors.stall_at_s = o.disturbance.stall_at_s;
    sensors.stall_s = o.disturbance.stall_s;
    sensors.realtime = o.realtime_priority;
    sensors.program = o.program;
    return sensors;
}

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

std::unique_ptr<audio::LivePerformance> make_live_sound(const RealtimeSession& session,
                                                        std::string& priority) {
    const RealtimeOptions& o = session.options;
    audio::LiveOptions live;
    live.output_lead_s = o.output_lead_s;
    live.longest_s = session.seconds + kSpareSoundS;
    live.jack_audio = o.jack_audio;
    live.midi_port = o.midi_port;
    live.midi_connect = o.midi_connect;
    live.on_thread_start = [&priority, realtime = o.realtime_priority] {
        priority = set_thread_priority(ThreadRole::sound, realtime);
    };
    return std::make_unique<audio::LivePerformance>(orchestra_file(), voices_of(session.kit), live);
}

}  // namespace app
