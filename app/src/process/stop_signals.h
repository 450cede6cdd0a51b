#pragma once
#include <csignal>

namespace app {

/// While this lives SIGINT, SIGTERM and SIGHUP do not end the program but set a mark: what is at hand is finished
/// in order. A SIGHUP that is ignored (nohup) stays so. One within another shares its mark.
class StopSignals {
public:
    StopSignals() {
        if (alive++ == 0) asked = 0;
        struct sigaction action {};
        action.sa_handler = [](int) { asked = 1; };
        sigaction(SIGINT, &action, &interrupt_);
        sigaction(SIGTERM, &action, &terminate_);
        sigaction(SIGHUP, nullptr, &hang_up_);
        if (hang_up_.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);
    }
    ~StopSignals() {
        sigaction(SIGINT, &interrupt_, nullptr);
        sigaction(SIGTERM, &terminate_, nullptr);
        sigaction(SIGHUP, &hang_up_, nullptr);
        --alive;
    }
    StopSignals(const StopSignals&) = delete;
    StopSignals& operator=(const StopSignals&) = delete;

    [[nodiscard]] static bool stopped() { return asked != 0; }

private:
    static inline volatile std::sig_atomic_t asked = 0;
    static inline int alive = 0;
    struct sigaction interrupt_ {
    }, terminate_{}, hang_up_{};
};

}  // namespace app
