#pragma once
#include <CLI/CLI.hpp>

namespace app {

/// Adds `modes` to the program.
void add_modes_command(CLI::App& program);

}  // namespace app
