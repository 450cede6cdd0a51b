#pragma once
#include <audio/live_performance.h>
#include <sim/simulation.h>
#include <tracking/trace.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "files/disk_log.h"
#include "files/output_folder.h"
#include "kit/kit.h"
#include "pictures/frame_thread.h"
#include "pictures/kit_stage.h"
#include "play/play_run.h"
#include "realtime/artificial_load.h"
#include "sensors/sensor_hub.h"

namespace app {

/// What a run in real time was asked for, beyond PlayOptions.
struct RealtimeOptions {
    PlayOptions play;
    /// No source: the trace, replayed. `sticks`: of live sources.
    SensorOptions sensors{{.source = {}, .sticks = {"left", "right"}}, {}, -1, 0, true, {}};
    audio::LiveOptions sound;
    double seconds = 0;      ///< how long; 0: the trace once; live sources: until they end
    bool lead_auto = false;  ///< both leads follow the measured delays, never below those asked for
    bool realtime_priority = true;
    ArtificialLoad disturbance;
};

/// Gets one line for each problem on the way.
using Warn = std::function<void(const std::string&)>;

/// What a run in real time plays, for how long, and everything that plays it.
struct RealtimeSession {
    /// Reads trace and kit. Throws BadInput for options that cannot be.
    explicit RealtimeSession(const RealtimeOptions& asked);
    RealtimeSession(const RealtimeSession&) = delete;
    RealtimeSession& operator=(const RealtimeSession&) = delete;
    /// Makes everything that plays; frames go into `folder`, the sound as it is made to the end of `recording`, which
    /// outlives the session.
    void start(const OutputFolder& folder, DiskLog<float>& recording, const Warn& warn);
    /// Of a lap.
    [[nodiscard]] double period_s() const { return static_cast<double>(period_samples) / audio::kSampleRate; }
    /// Threads and what they obtained.
    [[nodiscard]] std::vector<std::pair<std::string, std::string>> priorities() const;

    RealtimeOptions options;
    bool live = false;  ///< there is no trace
    PlayedTrace trace;  ///< of a live source only the sticks' names
    Kit kit;
    StickGeometry stick;                                  ///< also as a live source gives it
    std::shared_ptr<const tracking::PathModel> contacts;  ///< heard about strikes, where there is one
    double seconds = 0;
    std::vector<PedalMove> moves;     ///< of the schedule of pedals, within a lap
    std::size_t moves_left_out = 0;   ///< those before or after it
    std::int64_t period_samples = 0;  ///< of a lap; a live source has one, longer than the run

    // Since start():
    std::filesystem::path scratch;  ///< for what is measured
    std::int64_t epoch_ns = 0;      ///< CLOCK_MONOTONIC, when the run's clock is 0
    std::optional<KitStage> stage;
    std::unique_ptr<sim::Simulation> simulation;
    std::unique_ptr<audio::LivePerformance> sound;  ///< absent with --no-audio
    std::unique_ptr<FrameThread> frames;            ///< absent with --no-frames
    std::unique_ptr<SensorHub> sensors;
    std::string simulation_priority, sound_priority, control_priority;

private:
    void start_sound(DiskLog<float>& recording);
    void start_sensors();
};

}  // namespace app
