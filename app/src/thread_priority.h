#pragma once
#include <string>

namespace app {

/// What a thread does, from the most to the least urgent.
enum class ThreadRole { sound, sensing, control, simulation, drawing, writing };

/// Gives the calling thread, and threads that it starts from now on, its place: real-time scheduling
/// (SCHED_FIFO) for sound and sensing and a better nice value for control where that is permitted; without
/// privileges drawing and writing step back instead (nice 10 and 15; always permitted). `realtime` false:
/// never SCHED_FIFO. Says what was obtained ("SCHED_FIFO 70", "nice 10").
std::string set_thread_priority(ThreadRole role, bool realtime);

/// Back to ordinary scheduling, nice 0.
void leave_thread_priority();

}  // namespace app
