#pragma once
#include <string>
#include <vector>

namespace app {

/// Runs a program found on PATH and waits. Throws std::runtime_error (what was run, how it ended) unless it
/// exits with 0.
void run_child(const std::vector<std::string>& command);

}  // namespace app
