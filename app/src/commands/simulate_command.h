#pragma once
#include <CLI/CLI.hpp>

namespace app {

/// Adds `simulate`; its callback runs it and sets `status`: 1 when --until rest did not reach rest.
void add_simulate_command(CLI::App& program, int& status);

}  // namespace app
