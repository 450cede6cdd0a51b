#pragma once
#include <chrono>

namespace sim {

/// Wall time since `start` [s].
[[nodiscard]] inline double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace sim
