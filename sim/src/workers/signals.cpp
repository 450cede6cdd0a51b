#include "workers/signals.h"

#include <signal.h>

#include <array>
#include <csignal>

namespace sim {
namespace {

constexpr std::array kSignals{SIGTERM, SIGINT, SIGHUP};
volatile std::sig_atomic_t asked = 0;  // the signal that came

}  // namespace

void listen_for_leave() {
    struct sigaction action {};
    action.sa_handler = [](int signal) { asked = signal; };
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    for (const int signal : kSignals) {
        struct sigaction before {};
        sigaction(signal, nullptr, &before);
        if (signal != SIGHUP || before.sa_handler != SIG_IGN) sigaction(signal, &action, nullptr);
    }
}

bool leave_asked() {
    return asked != 0;
}

void stop_listening_for_leave() {
    struct sigaction action {};
    action.sa_handler = SIG_DFL;
    for (const int signal : kSignals) {
        struct sigaction before {};
        sigaction(signal, nullptr, &before);
        if (before.sa_handler != SIG_IGN) sigaction(signal, &action, nullptr);
    }
    if (asked != 0) raise(asked);
}

void block_signals() noexcept {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, nullptr);
}

}  // namespace sim
