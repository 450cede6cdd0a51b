#pragma once
#include <ctime>

namespace sim {

/// Processor time that this thread has used [s].
[[nodiscard]] inline double thread_processor_s() {
    timespec used{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
    return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}

}  // namespace sim
