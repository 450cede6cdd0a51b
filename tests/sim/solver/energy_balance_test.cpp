// The energy that an island may not gain in a step.
#include "solver/energy_balance.h"

#include <gtest/gtest.h>

#include "solver_island.h"

namespace {

using namespace world_test;

sim::WorldDefinition three_balls() {
    sim::WorldDefinition world = weightless();
    for (int i = 0; i < 3; ++i) {
        world.bodies.push_back(ball({0.999 * i, 0, 0}, sim::Fidelity::rigid, 0.5, 100. * (i + 1)));
        world.bodies.back().velocity = {0.1 * i, 0.05, 0.02 * i * i};
        world.bodies.back().angular_velocity = {0, 0.2 * i, 0.1};
    }
    return world;
}

TEST(EnergyBalance, TakesExactlyWhatWasGainedAndKeepsMomentum) {
    SolverIsland test(three_balls());
    sim::IslandRows& rows = test.begin();
    sim::EnergyBalance balance(rows);
    balance.note_start();
    const double before = test.kinetic_energy();
    EXPECT_NEAR(balance.before(), before, 1e-12 * before);
    test.bodies[0].state.velocity.x() -= 0.3;  // apart
    test.bodies[2].state.velocity.x() += 0.1;
    const Eigen::Vector3d linear = test.momentum(), angular = test.angular_momentum();
    ASSERT_GT(test.kinetic_energy(), 1.1 * before);
    balance.take_gain(balance.energy(false));
    EXPECT_NEAR(test.kinetic_energy(), before, 1e-12 * before);
    EXPECT_LT((test.momentum() - linear).norm(), 1e-12 * linear.norm());
    EXPECT_LT((test.angular_momentum() - angular).norm(), 1e-12 * angular.norm());
    EXPECT_EQ(rows.outside, Eigen::Vector3d::Zero());
}

TEST(EnergyBalance, LeavesALossAlone) {
    SolverIsland test(three_balls());
    sim::IslandRows& rows = test.begin();
    sim::EnergyBalance balance(rows);
    balance.note_start();
    for (sim::MovingBody& body : test.bodies) body.state.velocity *= 0.9;
    const Eigen::Vector3d velocity = test.bodies[2].state.velocity;
    balance.take_gain(balance.energy(false));
    EXPECT_EQ(test.bodies[2].state.velocity, velocity);
}

TEST(EnergyBalance, GoesBackToTheStart) {
    SolverIsland test(three_balls());
    sim::IslandRows& rows = test.begin();
    sim::EnergyBalance balance(rows);
    balance.note_start();
    const Eigen::Vector3d position = test.bodies[1].state.position;
    test.bodies[1].state.position.setOnes(), rows.outside.setOnes();
    balance.go_back();
    EXPECT_EQ(test.bodies[1].state.position, position);
    EXPECT_EQ(rows.outside, Eigen::Vector3d::Zero());
}

}  // namespace
