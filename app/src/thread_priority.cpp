#include "thread_priority.h"

#include <fmt/format.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace app {
namespace {

struct Place {
    int fifo;  // SCHED_FIFO priority, 0: not of real time
    int nice;
};

Place place_of(ThreadRole role) {
    switch (role) {
        case ThreadRole::sound:
            return {70, -11};
        case ThreadRole::sensing:
            return {60, -8};
        case ThreadRole::control:
            return {50, -6};
        case ThreadRole::simulation:
            return {0, -4};
        case ThreadRole::drawing:
            return {0, 10};
        case ThreadRole::writing:
            return {0, 15};
    }
    return {0, 0};
}

}  // namespace

std::string set_thread_priority(ThreadRole role, bool realtime) {
    const Place place = place_of(role);
    if (place.fifo > 0 && realtime) {
        sched_param parameter{};
        parameter.sched_priority = place.fifo;
        // Without SCHED_RESET_ON_FORK Csound's or a driver's own threads would inherit it.
        if (sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameter) == 0)
            return fmt::format("SCHED_FIFO {}", place.fifo);
    }
    if (place.nice < 0 && !realtime) return "nice 0";
    // On Linux the nice value is the thread's own.
    const auto thread = static_cast<id_t>(syscall(SYS_gettid));
    if (setpriority(PRIO_PROCESS, thread, place.nice) == 0) return fmt::format("nice {}", place.nice);
    return "nice 0";
}

void leave_thread_priority() {
    const sched_param parameter{};
    (void)sched_setscheduler(0, SCHED_OTHER, &parameter);
    (void)setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), 0);
}

}  // namespace app
