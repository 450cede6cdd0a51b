#pragma once
#include <CLI/CLI.hpp>

namespace app {

/// Adds `compare` to the program.
void add_compare_command(CLI::App& program);

}  // namespace app
