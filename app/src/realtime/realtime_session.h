#pragma once
#include <audio/live_performance.h>
#include <render/scene.h>

#include <memory>
#include <string>
#include <vector>

#include "realtime/realtime_run.h"

namespace app {

/// What a run in real time plays, and for how long: everything before its parts are started.
struct RealtimeSession {
    RealtimeOptions options;
    tracking::Trace trace;  ///< of a live source only the sticks' names
    Kit kit;
    StickGeometry stick;
    bool live = false;
    double seconds = 0;
    std::int64_t period_samples = 0;  ///< of a lap; a live source has one, longer than the run
};

/// Reads trace and kit. Throws BadInput for options that cannot be.
[[nodiscard]] RealtimeSession open_session(const RealtimeOptions& options);

/// The options of the sensor processes.
[[nodiscard]] SensorOptions sensors_of(const RealtimeSession& session, std::int64_t epoch_ns);
/// The stage for each level of picture quality that is drawn differently.
[[nodiscard]] std::vector<render::SceneDescription> scenes_of(const KitStage& stage, int width, int height);
/// Sets `priority` to what the audio thread obtained; `priority` must outlive the performance.
[[nodiscard]] std::unique_ptr<audio::LivePerformance> make_live_sound(const RealtimeSession& session,
                                                                      std::string& priority);

}  // namespace app
