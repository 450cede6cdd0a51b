#include "process/clock.h"

#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <ctime>

namespace app {

void sleep_until_ns(std::int64_t time_ns) noexcept {
    constexpr std::int64_t kNsPerS = 1'000'000'000;
    if (time_ns <= 0) return;
    const timespec until{time_ns / kNsPerS, time_ns % kNsPerS};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
    }
}

int milliseconds_until(std::int64_t time_ns) noexcept {
    return static_cast<int>((std::max<std::int64_t>(0, time_ns - monotonic_ns()) + 999'999) / 1'000'000);
}

bool readable_until(int descriptor, std::int64_t time_ns) noexcept {
    pollfd watched{descriptor, POLLIN, 0};
    return poll(&watched, 1, milliseconds_until(time_ns)) > 0;
}

double thread_cpu_s() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace app
