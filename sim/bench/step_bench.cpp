// Cost of one step of a kit of ten bodies with two sticks. Prints microseconds: median and 99th percentile.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <vector>

#include "../../tests/sim/test_kit.h"

int main() {
    sim_test::Scenario scenario(3);
    const auto simulation = sim::make_local_simulation(scenario.bodies());
    std::vector<double> us;
    std::size_t contacts = 0;
    for (int i = 0; i < 20000; ++i) {
        const sim::StepRequest request = scenario.next();
        const auto from = std::chrono::steady_clock::now();
        const sim::StepReply reply = simulation->step(request);
        us.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - from).count());
        contacts += reply.contacts.size();
        scenario.learn(reply);
    }
    std::sort(us.begin(), us.end());
    std::printf("10 bodies, 2 paths of 8 nodes, 2 pictures: median %.1f us, p99 %.1f us a step, %.2f contacts a step\n",
                us[us.size() / 2], us[us.size() * 99 / 100], double(contacts) / us.size());
}
