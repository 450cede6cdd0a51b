#pragma once
#include <sim/distributed_world.h>
#include <simulated_processors.h>

#include <map>
#include <numeric>
#include <string>
#include <vector>

#include "world_bodies.h"

/// Scenes that are shared out to workers, and what is seen of a run.
namespace world_test {

/// Modal balls that fall onto each other and roll in a box, a chain of three, a gate that opens, later
/// bodies.
inline sim::WorldScene busy_scene(int balls = 14) {
    sim::WorldScene scene;
    scene.world = on_floor();
    for (const double side : {-1.0, 1.0}) {
        scene.world.planes.push_back({Eigen::Vector3d(side, 0, 0), -2.6});
        scene.world.planes.push_back({Eigen::Vector3d(0, 0, side), -2.6});
    }
    for (int i = 0; i < balls; ++i) {
        sim::WorldBody body = ball({-1.8 + 1.15 * (i % 4), 0.6 + 1.1 * (i / 8), -0.6 + 1.2 * (i / 4 % 2)},
                                   i % 3 == 0 ? sim::Fidelity::linear : sim::Fidelity::modal);
        body.velocity = {0.4 * (i % 3), 0, 0.3 * (i % 5)};
        body.angular_velocity = {0.1 * i, 0, 0.3};
        scene.world.bodies.push_back(body);
    }
    sim::WorldBody post = box({0, 3.5, -2}, {0.2, 0.2, 0.2});
    post.fixed = true;
    scene.world.bodies.push_back(post);
    for (int i = 0; i < 3; ++i) {
        scene.world.bodies.push_back(ball({0.7 * (i + 1), 3.5, -2}, sim::Fidelity::rigid, 0.32));
        sim::PointConstraint link;
        link.name = "link";
        link.body_a = balls + i, link.point_a = {i == 0 ? 0.2 : 0.35, 0, 0};
        link.body_b = balls + i + 1, link.point_b = {-0.35, 0, 0};
        link.breaking_force = i == 2 ? 400 : std::numeric_limits<double>::infinity();
        scene.world.constraints.push_back(link);
    }
    scene.later = {ball({0.3, 4, 0.2}, sim::Fidelity::modal, 0.4), ball({-0.9, 4.5, 0.4})};
    scene.events = {{30, {0}, 0, 1, {}}, {45, {}, 1, 2, {}}};
    return scene;
}

/// The scene in one process.
inline sim::World alone(const sim::WorldScene& scene, std::uint64_t steps,
                        std::vector<std::uint64_t>* hashes = nullptr) {
    sim::World world(scene.world);
    if (hashes) hashes->assign(1, world.state_hash());
    std::size_t next = 0;
    for (std::uint64_t step = 0; step < steps; ++step) {
        for (; next < scene.events.size() && scene.events[next].step <= step; ++next) {
            const sim::WorldEvent& event = scene.events[next];
            for (const int constraint : event.removed) world.remove_constraint(constraint);
            for (std::size_t i = event.first; i < event.end; ++i) world.add_body(scene.later[i]);
        }
        world.step();
        if (hashes) hashes->push_back(world.state_hash());
    }
    return world;
}

inline sim::DistributedSettings for_steps(std::uint64_t steps) {
    sim::DistributedSettings settings;
    settings.steps = steps;
    return settings;
}

/// Workers in this process, by a clock that is modelled.
inline sim_bench::SimulatedProcessors processors(int count) {
    sim_bench::SimulatedProcessors how;
    how.count = count;
    how.modelled = true;
    return how;
}

/// At the end of every step, from 0.
inline std::vector<std::uint64_t> hashes_alone(const sim::WorldScene& scene, std::uint64_t steps) {
    std::vector<std::uint64_t> hashes;
    (void)alone(scene, steps, &hashes);
    return hashes;
}

/// Keeps what a run tells.
class Record : public sim::DistributedObserver {
public:
    struct Move {
        std::uint64_t step;
        int bodies, from, to;
    };
    void at(std::uint64_t step, const sim::World& world) override {
        in_order = in_order && step == hashes.size() && world.time_s() == static_cast<double>(step) * dt;
        hashes.push_back(world.state_hash());
    }
    void worked(const sim::WorkerStep& step) override { steps.push_back(step); }
    void moved(std::uint64_t step, int bodies, int from, int to) override {
        moves.push_back({step, bodies, from, to});
        if (from >= 0) own[from] -= bodies;
        own[to] += bodies;
    }
    void note(const std::string& what) override { notes += what + "\n"; }

    double dt = 1.0 / 60;
    bool in_order = true;
    std::vector<std::uint64_t> hashes;
    std::vector<sim::WorkerStep> steps;
    std::vector<Move> moves;
    std::map<int, int> own;  ///< bodies of each worker as registered
    std::string notes;
};

}  // namespace world_test
