#include <gtest/gtest.h>

#include <limits>

#include "shared_scenes.h"

// Forces, prescribed motions, hinges and sliders in worlds that workers share.

using namespace world_test;

namespace {

/// The busy scene with a bat that sweeps through it, a door that it strikes, a slider, forces and an impulse.
sim::WorldScene scheduled() {
    sim::WorldScene scene = busy_scene(8);
    sim::WorldDefinition& world = scene.world;
    const int first = static_cast<int>(world.bodies.size());
    sim::WorldBody bat = box({-2.4, 0.5, 0}, {0.1, 0.4, 1});
    bat.motion = {{0.2, {-2.4, 0.5, 0}}, {0.7, {1.5, 0.5, 0}}, {1.3, {1.5, 0.5, 0}, {0, 0, 1, 0}}};
    sim::WorldBody door = box({0.5, 1.9, 1.8}, {0.5, 0.6, 0.05}), slide = box({0, 2.5, 0}, {0.3, 0.1, 0.1});
    world.bodies.insert(world.bodies.end(), {bat, door, slide});
    const auto axis = [](const Eigen::Vector3d& along) {
        return Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), along);
    };
    sim::PointConstraint hinge, rail;
    hinge.joint = sim::Joint::hinge, hinge.stiffness = std::numeric_limits<double>::infinity();
    hinge.body_a = first + 1, hinge.point_a = {-0.5, 0, 0}, hinge.point_b = {0, 1.9, 1.8};
    hinge.frame_a = hinge.frame_b = axis({0, 1, 0});
    rail.joint = sim::Joint::slider, rail.stiffness = 1e6;
    rail.body_a = first + 2, rail.point_b = {0, 2.5, 0}, rail.frame_a = rail.frame_b = axis({1, -1, 0});
    world.constraints.insert(world.constraints.end(), {hinge, rail});
    const int late = static_cast<int>(world.bodies.size());
    world.forces = {{0, {0.1, 0, 0}, {30, 200, 0}, false, 0.3, 0.9},
                    {3, {0, 0.2, 0}, {0, 0, 60}, true, 0.51, 0.51},
                    {first + 1, {0.4, 0, 0}, {0, 0, -40}, true, 0.1, 0.4},
                    {late, {0, 0, 0}, {20, 0, 0}, false, 0.8, 0.8}};
    return scene;
}

}  // namespace

TEST(Schedule, OfBatsDoorsSlidersAndForcesWorkersKeepTheMomentum) {
    const sim::WorldScene scene = scheduled();
    for (const int workers : {1, 2, 3, 7}) {
        struct : Record {
            Eigen::Vector3d first, momentum;
            void at(std::uint64_t step, const sim::World& world) override {
                Record::at(step, world);
                momentum = world.momentum();
                if (step == 0) first = momentum;
            }
        } record;
        const sim::DistributedResult result =
            sim_bench::simulate_processors(scene, for_steps(110), processors(workers), record);
        EXPECT_LT((record.momentum - record.first - result.outside_impulse).norm(),
                  1e-9 * result.outside_impulse.norm())
            << workers;
        EXPECT_EQ(result.refused_messages, 0u) << record.notes;
    }
}

// Every force acts once, whoever owns the body: momentum is what came from outside, which is told.
TEST(Schedule, BoundedWorkersGiveEveryForceOnce) {
    sim::WorldScene scene;
    scene.world = weightless();
    for (int i = 0; i < 12; ++i) {
        sim::WorldBody body = ball({1.05 * (i % 4), 0, 1.05 * (i / 4)}, sim::Fidelity::rigid);
        body.name += std::to_string(i);
        scene.world.bodies.push_back(body);
    }
    Eigen::Vector3d all = Eigen::Vector3d::Zero();
    for (int i = 0; i < 12; ++i) {
        const Eigen::Vector3d force(5 * (i % 3) - 3, 2, 4 - i);
        scene.world.forces.push_back({i, {0, 0, 0.2}, force, false, 0.2 + 0.03 * i, 0.8});
        all += (0.6 - 0.03 * i) * force;
        scene.world.forces.push_back({i, {0, 0, 0}, {0, 0, 3}, false, 0.5, 0.5});
        all.z() += 3;
    }
    for (const int bound : {0, 4}) {
        sim::DistributedSettings settings = for_steps(90);
        settings.bound = bound;
        struct : Record {
            Eigen::Vector3d momentum;
            void at(std::uint64_t step, const sim::World& world) override {
                Record::at(step, world);
                momentum = world.momentum();
            }
        } record;
        const sim::DistributedResult result =
            sim_bench::simulate_processors(scene, settings, processors(3), record);
        EXPECT_LT((result.outside_impulse - all).norm(), 1e-9 * all.norm()) << bound;
        EXPECT_LT((record.momentum - all).norm(), 1e-9 * all.norm()) << bound;  // the last states are exact
    }
}

TEST(Schedule, ARunUntilRestWaitsForWhatIsToCome) {
    sim::WorldScene scene;
    scene.world = on_floor();
    scene.world.bodies.push_back(box({0, 0.5, 0}, {0.5, 0.5, 0.5}));
    scene.world.forces.push_back({0, {0, 0, 0}, {0, 2000, 0}, false, 3, 3.1});
    sim::WorldBody far = box({20, 0.5, 0}, {0.5, 0.5, 0.5});
    far.motion = {{0, {20, 0.5, 0}}, {5, {20, 0.5, 0}}, {6, {30, 0.5, 0}}};
    for (const bool driven : {false, true}) {
        if (driven) scene.world.bodies.push_back(far);
        sim::DistributedSettings settings = for_steps(2000);
        settings.until_rest = true;
        Record record;
        const sim::DistributedResult result = sim::run_alone(scene, settings, record);
        EXPECT_TRUE(result.rest_reached);
        EXPECT_GT(result.steps, driven ? 359u : 186u);
        EXPECT_LT(result.steps, 600u);
    }
}
