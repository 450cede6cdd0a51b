#pragma once
#include <string>

namespace app {

/// What a thread does, from the most to the least urgent.
enum class ThreadRole { sound, sensing, control, simulation, drawing, writing };

/// Gives the calling thread, and threads and processes that it starts from now on, its place. Where real-time
/// scheduling is permitted (and `realtime`): SCHED_FIFO for sound, sensing and control, nice -8 for the
/// simulation, 10 for writing; drawing stays at 0, so that beside a foreign load pictures keep their share.
/// Else drawing and writing step back to SCHED_IDLE, which needs no privilege and gives way to every other
/// thread at once, and the others stay as they are. Says what was obtained ("SCHED_FIFO 70", "as it was").
std::string set_thread_priority(ThreadRole role, bool realtime);

/// Back to ordinary scheduling and the nice value before the thread's last set_thread_priority().
void leave_thread_priority();

}  // namespace app
