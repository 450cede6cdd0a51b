#pragma once
#include <CLI/CLI.hpp>

namespace app {

/// Adds `play` to the program.
void add_play_command(CLI::App& program);

}  // namespace app
