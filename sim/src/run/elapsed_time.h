#pragma once
#include <chrono>
#include <ctime>

namespace sim {

/// Wall time since `start` [s].
[[nodiscard]] inline double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

[[nodiscard]] inline double processor_s_by(clockid_t clock) {
    timespec used{};
    clock_gettime(clock, &used);
    return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}
/// Processor time that this thread has used [s].
[[nodiscard]] inline double thread_processor_s() {
    return processor_s_by(CLOCK_THREAD_CPUTIME_ID);
}
/// Processor time that all threads of this process have used [s].
[[nodiscard]] inline double process_processor_s() {
    return processor_s_by(CLOCK_PROCESS_CPUTIME_ID);
}

}  // namespace sim
