#pragma once
#include <signal.h>

namespace sim {

/// Blocks all signals in the calling thread: a signal would make a ZeroMQ call fail. Main threads take them.
inline void block_signals() noexcept {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, nullptr);
}

}  // namespace sim
