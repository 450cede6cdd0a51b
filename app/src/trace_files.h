#pragma once
#include <tracking/trace.h>

#include <filesystem>
#include <string>

namespace app {

/// A trace by path, or by the name of a bundled one ("flourish" is assets/traces/flourish.csv).
[[nodiscard]] std::filesystem::path find_trace(const std::string& name_or_path);

}  // namespace app
