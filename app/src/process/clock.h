#pragma once
#include <chrono>
#include <cstdint>

namespace app {

/// CLOCK_MONOTONIC now, which all processes of a machine share [ns].
[[nodiscard]] std::int64_t monotonic_ns() noexcept;
/// Sleeps until that time; returns at once if it has passed.
void sleep_until_ns(std::int64_t time_ns) noexcept;

/// A time of steady_clock, which is the same clock.
[[nodiscard]] inline std::int64_t monotonic_ns(std::chrono::steady_clock::time_point time) {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count();
}
[[nodiscard]] inline std::int64_t to_ns(double seconds) {
    return static_cast<std::int64_t>(seconds * 1e9);
}
[[nodiscard]] inline double to_s(std::int64_t ns) {
    return static_cast<double>(ns) / 1e9;
}

/// Processor time that this thread has used [s].
[[nodiscard]] double thread_cpu_s();

/// Seconds of wall time since it was made.
class WallTimer {
public:
    [[nodiscard]] double seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    }

private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace app
