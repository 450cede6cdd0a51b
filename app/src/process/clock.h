#pragma once
#include <chrono>
#include <cmath>
#include <cstdint>

namespace app {

/// A time of steady_clock, which is CLOCK_MONOTONIC [ns].
[[nodiscard]] inline std::int64_t monotonic_ns(std::chrono::steady_clock::time_point time) noexcept {
    return std::chrono::nanoseconds(time.time_since_epoch()).count();
}
/// CLOCK_MONOTONIC now, which all processes of a machine share [ns].
[[nodiscard]] inline std::int64_t monotonic_ns() noexcept {
    return monotonic_ns(std::chrono::steady_clock::now());
}
[[nodiscard]] inline std::int64_t to_ns(double seconds) {
    return std::llround(seconds * 1e9);
}
[[nodiscard]] inline double to_s(std::int64_t ns) {
    return static_cast<double>(ns) / 1e9;
}

/// Sleeps until that time; returns at once if it has passed.
void sleep_until_ns(std::int64_t time_ns) noexcept;
/// Milliseconds from now until then, rounded up; 0 if it has passed.
[[nodiscard]] int milliseconds_until(std::int64_t time_ns) noexcept;
/// Waits until there is something to read from a descriptor, at most until that time; true: there is.
[[nodiscard]] bool readable_until(int descriptor, std::int64_t time_ns) noexcept;

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

/// Seconds of wall time that `work()` takes.
template <class Work>
[[nodiscard]] double seconds_of(const Work& work) {
    const WallTimer timer;
    work();
    return timer.seconds();
}

/// Adds the seconds of wall time of its life to a sum.
class Stopwatch {
public:
    explicit Stopwatch(double& sum_s) : sum_s_(sum_s) {}
    ~Stopwatch() { sum_s_ += timer_.seconds(); }
    Stopwatch(const Stopwatch&) = delete;
    Stopwatch& operator=(const Stopwatch&) = delete;

private:
    double& sum_s_;
    WallTimer timer_;
};

}  // namespace app
