#pragma once
#include <CLI/CLI.hpp>

namespace app {

/// Makes `program` that of `musicworld bench NAME`: our speed beside peers', and what accuracy costs.
void add_bench_options(CLI::App& program);

}  // namespace app
