#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace app {

/// Runs a program found on PATH with its output in `log`, and waits. Throws std::runtime_error (what was run,
/// how it ended) unless it exits with 0.
void run_child(const std::vector<std::string>& command, const std::filesystem::path& log);

}  // namespace app
