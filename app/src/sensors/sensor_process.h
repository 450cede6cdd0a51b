#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "sensors/sample_source.h"
#include "sticks/stick_filters.h"

namespace app {

/// What a sensor process is told. Descriptors are inherited from the hub.
struct SensorTask {
    SourceOptions source;
    StickPredictors predictors;
    std::vector<int> state_fds;  ///< shared memory, one a stick
    int wake_fd = -1;            ///< eventfd that is written after each publication
    int life_fd = -1;            ///< a pipe that ends with the hub
    double stall_at_s = -1, stall_s = 0;
    bool realtime = true;
};

/// A sensor process: one thread reads the source at its own pace, one per stick filters and publishes (a slow
/// external predictor holds up its own stick alone), and this one reports and watches for the end. Returns the
/// exit status: 0 when the source has ended, the hub is gone or SIGTERM came; 1 when it failed, which its report
/// says.
[[nodiscard]] int run_sensor(const SensorTask& task);

/// The words after the program's name with which the command `sensor` gets a task.
[[nodiscard]] std::vector<std::string> sensor_arguments(const SensorTask& task);

}  // namespace app
