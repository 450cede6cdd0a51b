#include "process/thread_priority.h"

#include <fmt/format.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>

namespace app {
namespace {

struct Scheduling {
    int fifo;  // priority of SCHED_FIFO; 0: not of real time
    int nice;
};
/// By ThreadRole.
constexpr std::array<Scheduling, 6> kScheduling = {{{70, 0}, {60, 0}, {50, 0}, {0, -8}, {0, 0}, {0, 10}}};
static_assert(kScheduling.size() == static_cast<std::size_t>(ThreadRole::writing) + 1);

bool schedule(int policy, int priority) {
    sched_param parameter{};
    parameter.sched_priority = priority;
    return sched_setscheduler(0, policy, &parameter) == 0;
}

/// On Linux the nice value is the thread's own.
bool set_nice(int value) {
    return setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), value) == 0;
}

thread_local int nice_before = 0;

bool realtime_permitted() {
    const bool permitted = schedule(SCHED_FIFO | SCHED_RESET_ON_FORK, 1);
    if (permitted) schedule(SCHED_OTHER, 0);
    return permitted;
}

}  // namespace

std::string set_thread_priority(ThreadRole role, bool realtime) {
    nice_before = getpriority(PRIO_PROCESS, 0);
    if (realtime && realtime_permitted()) {
        // Without SCHED_RESET_ON_FORK Csound's or a driver's own threads would inherit it.
        const auto [fifo, nice] = kScheduling[static_cast<std::size_t>(role)];
        if (fifo > 0 && schedule(SCHED_FIFO | SCHED_RESET_ON_FORK, fifo))
            return fmt::format("SCHED_FIFO {}", fifo);
        return fifo == 0 && set_nice(nice) ? fmt::format("nice {}", nice) : "as it was";
    }
    const bool behind = role == ThreadRole::drawing || role == ThreadRole::writing;
    return behind && schedule(SCHED_IDLE, 0) ? "SCHED_IDLE" : "as it was";
}

void leave_thread_priority() {
    (void)schedule(SCHED_OTHER, 0);
    (void)set_nice(nice_before);
}

}  // namespace app
