#pragma once
#include <chrono>
#include <cstdint>
#include <ctime>

namespace app {

/// CLOCK_MONOTONIC, which all processes of a machine share, in nanoseconds (steady_clock is the same clock).
[[nodiscard]] inline std::int64_t monotonic_ns() {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1'000'000'000LL + now.tv_nsec;
}

[[nodiscard]] inline std::int64_t monotonic_ns(std::chrono::steady_clock::time_point time) {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count();
}

[[nodiscard]] inline std::int64_t to_ns(double seconds) {
    return static_cast<std::int64_t>(seconds * 1e9);
}

}  // namespace app
