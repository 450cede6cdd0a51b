#pragma once
#include <ctime>

namespace sim {

[[nodiscard]] inline double processor_s_by(clockid_t clock) {
    timespec used{};
    clock_gettime(clock, &used);
    return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}
/// Processor time that this thread has used [s].
[[nodiscard]] inline double thread_processor_s() {
    return processor_s_by(CLOCK_THREAD_CPUTIME_ID);
}
/// That all threads of this process have used [s].
[[nodiscard]] inline double process_processor_s() {
    return processor_s_by(CLOCK_PROCESS_CPUTIME_ID);
}

}  // namespace sim
