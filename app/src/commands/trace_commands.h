#pragma once
#include <CLI/CLI.hpp>

namespace app {

/// `musicworld trace info|check|convert|synth`.
void add_trace_command(CLI::App& program);

}  // namespace app
