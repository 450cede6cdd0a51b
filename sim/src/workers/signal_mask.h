#pragma once
#include <signal.h>

namespace sim {

/// Signals are for the main thread: a ZeroMQ call that one interrupts fails. For the start of any other.
inline void block_signals() noexcept {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, nullptr);
}

}  // namespace sim
