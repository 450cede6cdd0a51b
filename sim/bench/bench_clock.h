#pragma once
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <ctime>
#include <vector>

namespace sim_bench {

/// What a clock shows [s].
[[nodiscard]] inline double clock_s(clockid_t clock) {
    timespec now{};
    clock_gettime(clock, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}
[[nodiscard]] inline double wall_s() {
    return clock_s(CLOCK_MONOTONIC);
}
[[nodiscard]] inline double thread_cpu_s() {  ///< of this thread
    return clock_s(CLOCK_THREAD_CPUTIME_ID);
}
[[nodiscard]] inline double process_cpu_s() {  ///< of all threads of this process
    return clock_s(CLOCK_PROCESS_CPUTIME_ID);
}

/// The upper one of two in the middle; 0 of none.
[[nodiscard]] inline double median_of(std::vector<double> values) {
    if (values.empty()) return 0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

}  // namespace sim_bench
