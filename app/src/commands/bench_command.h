#pragma once
#include <CLI/CLI.hpp>

namespace app {

/// `musicworld bench NAME`: our speed beside peers', and what accuracy costs.
void add_bench_command(CLI::App& program);

}  // namespace app
