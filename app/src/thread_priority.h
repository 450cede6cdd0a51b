#pragma once
#include <string>

namespace app {

/// What a thread does, from the most to the least urgent.
enum class ThreadRole { sound, sensing, control, simulation, drawing, writing };

/// Gives the calling thread, and threads and processes that it starts from now on, its place. Drawing and
/// writing step back to SCHED_IDLE, which needs no privilege and gives way to every other thread at once.
/// Where it is permitted (and `realtime`), sound, sensing and control have SCHED_FIFO and the simulation a
/// better nice value; else they stay as they are. Says what was obtained ("SCHED_FIFO 70", "nice 0").
std::string set_thread_priority(ThreadRole role, bool realtime);

/// Back to ordinary scheduling, nice 0.
void leave_thread_priority();

}  // namespace app
