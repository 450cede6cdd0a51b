#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "processes.h"
#include "sim/distributed_world.h"
#include "workers/worker_process.h"
#include "world_bodies.h"

/// Shared worlds on real processes: a scene, what is seen of it, and the processes.
namespace sim_test {

/// A heap of soft balls and rigid boxes that falls, touches and is joined: contacts between all workers.
inline sim::WorldScene heap(int bodies) {
    sim::WorldScene scene;
    scene.world = world_test::on_floor();
    for (int i = 0; i < bodies; ++i) {
        const Eigen::Vector3d at(0.95 * (i % 3), 0.6 + 1.05 * (i / 9), 0.95 * (i / 3 % 3));
        scene.world.bodies.push_back(i % 4 == 3 ? world_test::box(at, {0.4, 0.5, 0.4})
                                                : world_test::ball(at, sim::Fidelity::modal));
        scene.world.bodies.back().name += std::to_string(i);
        scene.world.bodies.back().velocity = Eigen::Vector3d(0.1 * (i % 5) - 0.2, 0, 0.05 * (i % 7));
    }
    scene.world.constraints.push_back({"hangs", 0, {0, 0.5, 0}, -1, {0, 2.5, 0}});
    scene.events = {{40, {0}, 0, 0, {}}};
    return scene;
}

/// Watches the momentum, and does something at a step, once.
class Watcher : public sim::DistributedObserver {
public:
    std::uint64_t last_step = 0;
    Eigen::Vector3d first_momentum = Eigen::Vector3d::Zero(), momentum = first_momentum;
    std::vector<std::string> notes;
    std::vector<std::uint64_t> act_at;
    std::function<void()> act;

    void at(std::uint64_t step, const sim::World& world) override {
        last_step = step, momentum = world.momentum();
        if (step == 0) first_momentum = momentum;
        if (std::find(act_at.begin(), act_at.end(), step) != act_at.end()) act();
    }
    void note(const std::string& what) override { notes.push_back(what); }
    [[nodiscard]] bool noted(const std::string& part) const {
        return std::any_of(notes.begin(), notes.end(),
                           [&](const std::string& n) { return n.find(part) != std::string::npos; });
    }
};

/// The bodies' momentum at the end is what came from outside; to rounding, in units of 1 N s.
inline void expect_momentum_kept(const Watcher& watcher, const sim::DistributedResult& result) {
    EXPECT_LT((watcher.momentum - watcher.first_momentum - result.outside_impulse).norm(),
              1e-9 * (1 + result.outside_impulse.norm()))
        << testing::PrintToString(watcher.notes);
}

/// So many workers, started here.
inline sim::DistributedLaunch processes(int count) {
    sim::DistributedLaunch launch;
    launch.processes = run_test("WorldProcess.DISABLED_Works", count);
    return launch;
}

/// A worker started by somebody else.
inline sim::WorkerProcess start_elsewhere(const std::string& endpoint, const std::string& key = {}) {
    sim::WorkerLaunch launch = run_test("WorldProcess.DISABLED_Works", 1);
    if (!key.empty()) launch.arguments.insert(launch.arguments.end(), {"--key", key});
    return {launch, endpoint};
}

inline sim::DistributedSettings for_steps(std::uint64_t steps) {
    sim::DistributedSettings settings;
    settings.steps = steps;
    return settings;
}

}  // namespace sim_test
