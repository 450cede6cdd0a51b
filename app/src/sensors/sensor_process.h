#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "sensors/sample_source.h"
#include "sticks/stick_filters.h"

namespace app {

/// The sensors of a run: their source, with `epoch_ns` also that of live times, and their predictors.
struct SensorOptions : SourceOptions {
    StickPredictors predictors;
    double stall_at_s = -1, stall_s = 0;  ///< --disturb: a pause of the reader, for tests; < 0: none
    bool realtime = true;                 ///< real-time scheduling where that is permitted
    std::string program;                  ///< that has the command `sensor`; empty: this one
};

/// The sticks of one sensor process. Descriptors are inherited from the hub.
struct SensorTask : SensorOptions {
    std::vector<int> state_fds;  ///< shared memory, one for each stick
    int wake_fd = -1;            ///< eventfd that is written after each publication
    int life_fd = -1;            ///< a pipe that ends with the hub
};

/// Calls field(name, member, help) for all that the command `sensor` is started with.
void for_each_sensor_option(auto& task, const auto& field) {
    field("--source", task.source, "trace:FILE, stdin, zmq:ENDPOINT or osc:PORT");
    field("--stick", task.sticks, "Name; once for each stick");
    field("--epoch-ns", task.epoch_ns, "CLOCK_MONOTONIC at which the run begins [ns]");
    field("--period", task.period_s, "A trace begins again that long after it began [s]; 0: never");
    field("--resume", task.resume, "Go on at the current time");
    field("--stall-at", task.stall_at_s, "Pause the reader then [s since the epoch]");
    field("--stall", task.stall_s, "for that long [s]");
    field("--picture", task.predictors.picture, "Predictor of pictures");
    field("--sound", task.predictors.sound, "Predictor of sound");
    field("--confirming", task.predictors.confirming, "Predictor that confirms contacts; none if left out");
    field("--sound-lead", task.predictors.sound_lead_s, "Contacts are looked for so far ahead [s]");
    field("--state-fd", task.state_fds, "Shared memory; once for each stick");
    field("--wake-fd", task.wake_fd, "eventfd");
    field("--life-fd", task.life_fd, "Pipe that ends with the application");
    field("--realtime", task.realtime, "Real-time scheduling where that is permitted");
}

/// A sensor process: one thread reads the source at its own pace, one per stick filters and publishes (a slow
/// external predictor holds up its own stick alone), and this one reports and watches for the end. Returns the
/// exit status: 0 when the source has ended, the hub is gone or SIGTERM came; 1 when it failed, which its report
/// says.
[[nodiscard]] int run_sensor(const SensorTask& task);

/// The words after the program's name with which the command `sensor` gets a task.
[[nodiscard]] std::vector<std::string> sensor_arguments(const SensorTask& task);

}  // namespace app
