#pragma once
#include <CLI/CLI.hpp>

namespace app {

/// Adds `keys` to the program.
void add_keys_command(CLI::App& program);
/// Adds `worker`, which is for launchers.
void add_worker_command(CLI::App& program, int& status);

}  // namespace app
