#pragma once
#include <CLI/CLI.hpp>

namespace app {

/// `musicworld bench ...`: becomes musicworld_bench, a program beside this one, with the same arguments. The
/// benchmarks and their peers are not part of this program.
void add_bench_command(CLI::App& program);

}  // namespace app
