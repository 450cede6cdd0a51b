#pragma once
// Sensor hubs as tests see them. Waits are bounded by seconds, so that a loaded machine passes; no delay is asserted.
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <vector>

#include "process/clock.h"
#include "sensors/sensor_hub.h"
#include "sticks/predictors.h"

namespace app_test {

using app::SensorEvent;
using app::SensorHub;
using Kind = app::SensorEvent::Kind;

inline app::SensorOptions options_for(const std::string& source,
                                      std::vector<std::string> sticks = {"left", "right"}) {
    app::SensorOptions options;
    options.source = source;
    options.sticks = std::move(sticks);
    options.predictors = app::stick_predictors("auto", "auto", 1.0 / 15);
    options.program = MUSICWORLD_PROGRAM;
    options.epoch_ns = app::monotonic_ns() + 300'000'000;
    return options;
}

/// The processes that this one has started and not yet collected.
inline std::vector<int> children() {
    std::ifstream list("/proc/self/task/" + std::to_string(getpid()) + "/children");
    std::vector<int> pids;
    for (int pid = 0; list >> pid;) pids.push_back(pid);
    return pids;
}

/// Collects all states that are seen, and all events, until `enough` or 20 s are over.
struct Watched {
    std::vector<std::vector<tracking::StickState>> states;
    std::vector<SensorEvent> events;

    [[nodiscard]] std::size_t count(Kind kind) const {
        return static_cast<std::size_t>(std::count_if(events.begin(), events.end(),
                                                      [&](const SensorEvent& e) { return e.kind == kind; }));
    }
    [[nodiscard]] std::string all_messages() const {
        std::string text;
        for (const SensorEvent& e : events) text += e.message + "\n";
        return text;
    }
    /// A machine that is held up for 100 ms makes silences that no test here is about.
    [[nodiscard]] std::string messages_but_of_silence() const {
        std::string text;
        for (const SensorEvent& e : events)
            if (e.kind != Kind::silent && e.kind != Kind::back) text += e.message + "\n";
        return text;
    }
};

template <class Enough>
void watch_until(SensorHub& hub, std::size_t sticks, Watched& seen, Enough enough) {
    seen.states.resize(sticks);
    const std::int64_t until = app::monotonic_ns() + 20'000'000'000;
    while (app::monotonic_ns() < until) {
        pollfd wake{hub.wake_fd(), POLLIN, 0};
        poll(&wake, 1, 10);
        hub.clear_wake();
        for (std::size_t stick = 0; stick < sticks; ++stick) {
            const auto state = hub.newest(stick);
            if (state && (seen.states[stick].empty() || seen.states[stick].back().samples != state->samples))
                seen.states[stick].push_back(*state);
        }
        for (SensorEvent& event : hub.watch()) seen.events.push_back(std::move(event));
        if (enough()) return;
    }
    ADD_FAILURE() << "waited 20 s in vain; messages:\n" << seen.all_messages();
}

}  // namespace app_test
