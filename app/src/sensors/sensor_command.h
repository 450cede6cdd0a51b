#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "sensors/sensor_process.h"

namespace app {

/// `musicworld sensor`, which the program itself starts.
void add_sensor_command(CLI::App& program, int& status);

/// The arguments with which that command gets a task.
[[nodiscard]] std::vector<std::string> sensor_arguments(const SensorTask& task);

}  // namespace app
