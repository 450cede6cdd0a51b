#pragma once
#include <time.h>

#include <cerrno>
#include <cstdint>

namespace audio {

/// Now, in nanoseconds of CLOCK_MONOTONIC.
[[nodiscard]] inline std::int64_t monotonic_ns() noexcept {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return std::int64_t{1'000'000'000} * now.tv_sec + now.tv_nsec;
}

/// Sleeps until `at_ns` of CLOCK_MONOTONIC; returns at once where that is past.
inline void sleep_until_ns(std::int64_t at_ns) noexcept {
    const timespec at{.tv_sec = at_ns / 1'000'000'000, .tv_nsec = at_ns % 1'000'000'000};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr) == EINTR) {
    }
}

/// Processor time of the calling thread [s].
[[nodiscard]] inline double thread_seconds() noexcept {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Length of so many samples at 48 kHz [ns], rounded down.
[[nodiscard]] constexpr std::int64_t samples_ns(std::int64_t samples) noexcept {
    return samples * 62500 / 3;
}

/// Whole samples at 48 kHz in so long, rounded down.
[[nodiscard]] constexpr std::int64_t ns_samples(std::int64_t ns) noexcept {
    return ns >= 0 ? ns * 3 / 62500 : -((-ns * 3 + 62499) / 62500);
}

}  // namespace audio
