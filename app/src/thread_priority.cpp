#include "thread_priority.h"

#include <fmt/format.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace app {
namespace {

constexpr int kSimulationNice = -8;

/// SCHED_FIFO priority; 0: not of real time.
int fifo_of(ThreadRole role) {
    switch (role) {
        case ThreadRole::sound:
            return 70;
        case ThreadRole::sensing:
            return 60;
        case ThreadRole::control:
            return 50;
        default:
            return 0;
    }
}

bool schedule(int policy, int priority) {
    sched_param parameter{};
    parameter.sched_priority = priority;
    return sched_setscheduler(0, policy, &parameter) == 0;
}

bool set_nice(int value) {
    // On Linux the nice value is the thread's own.
    return setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), value) == 0;
}

}  // namespace

std::string set_thread_priority(ThreadRole role, bool realtime) {
    if (role == ThreadRole::drawing || role == ThreadRole::writing)
        return schedule(SCHED_IDLE, 0) ? "SCHED_IDLE" : "nice 0";
    // Without SCHED_RESET_ON_FORK Csound's or a driver's own threads would inherit it.
    const int fifo = realtime ? fifo_of(role) : 0;
    if (fifo > 0 && schedule(SCHED_FIFO | SCHED_RESET_ON_FORK, fifo))
        return fmt::format("SCHED_FIFO {}", fifo);
    if (realtime && role == ThreadRole::simulation && set_nice(kSimulationNice))
        return fmt::format("nice {}", kSimulationNice);
    return "nice 0";
}

void leave_thread_priority() {
    (void)schedule(SCHED_OTHER, 0);
    (void)set_nice(0);
}

}  // namespace app
