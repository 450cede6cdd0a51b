#pragma once
#include <CLI/CLI.hpp>

namespace app {

/// Adds `predict` to the program.
void add_predict_command(CLI::App& program);

}  // namespace app
