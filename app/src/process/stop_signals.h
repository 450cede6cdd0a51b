#pragma once
#include <csignal>

namespace app {

/// While this lives SIGINT and SIGTERM do not end the program but set a mark: what is at hand is finished in
/// order. One at a time.
class StopSignals {
public:
    StopSignals() {
        asked = 0;
        struct sigaction action {};
        action.sa_handler = [](int) { asked = 1; };
        sigaction(SIGINT, &action, &interrupt_);
        sigaction(SIGTERM, &action, &terminate_);
    }
    ~StopSignals() {
        sigaction(SIGINT, &interrupt_, nullptr);
        sigaction(SIGTERM, &terminate_, nullptr);
    }
    StopSignals(const StopSignals&) = delete;
    StopSignals& operator=(const StopSignals&) = delete;

    [[nodiscard]] static bool stopped() { return asked != 0; }

private:
    static inline volatile std::sig_atomic_t asked = 0;
    struct sigaction interrupt_ {
    }, terminate_{};
};

}  // namespace app
