// A substep by sweeps over contacts.
#include "solver/sweeps.h"

#include <gtest/gtest.h>

#include "solver_island.h"

namespace {

using namespace world_test;

/// The substeps of a step.
void sweep(SolverIsland& test) {
    sim::IslandRows& rows = test.begin();
    sim::AppliedForces forces(rows);
    forces.begin_step(test.no_forces);
    sim::Impacts impacts(rows, forces);
    impacts.begin();
    sim::Sweeps sweeps(rows, forces, impacts);
    for (int i = 0; i < test.settings.substeps; ++i) {
        rows.substep.number = i;
        sweeps.substep(false, i + 1 == test.settings.substeps);
    }
}

/// A ball that slides on a plane.
sim::WorldDefinition slider(double speed, double friction) {
    sim::WorldDefinition world = on_floor();
    world.planes[0].friction = 1;
    world.bodies = {ball({0, 0.5, 0})};
    world.bodies[0].friction = friction * friction;  // of a pair: the square root of the product
    world.bodies[0].velocity = {speed, 0, 0};
    return world;
}

TEST(Sweeps, ABallThatSlidesLosesFrictionTimesGravityTimesTime) {
    for (const double friction : {0.1, 0.3, 0.6}) {
        SolverIsland test(slider(1, friction));
        sweep(test);
        const double lost = friction * 9.81 * test.settings.dt;
        EXPECT_NEAR(test.bodies[0].state.velocity.x(), 1 - lost, 1e-4 * lost);  // single precision
    }
}

TEST(Sweeps, ABallThatSlidesSlowlyRolls) {
    SolverIsland test(slider(0.01, 0.5));
    sweep(test);
    // Five sevenths of the speed: what its angular momentum about the place where it slides comes to.
    EXPECT_NEAR(test.bodies[0].state.velocity.x(), 0.01 * 5 / 7, 1e-4 * 0.01);
}

TEST(Sweeps, DeepOverlapsPartAtThreeMetresASecondAtMostAndKeepNoSpeed) {
    sim::WorldDefinition world = weightless();
    world.planes.push_back({});
    world.bodies = {ball({0, 0.2, 0})};
    SolverIsland test(world);
    sweep(test);
    const double rise = test.bodies[0].state.position.y() - 0.2;
    EXPECT_GT(rise, 0.001);
    EXPECT_LE(rise, 3 * test.settings.dt + 1e-9);
    EXPECT_NEAR(test.bodies[0].state.velocity.y(), 0, 1e-5);
}

TEST(Sweeps, ASweptPairKeepsItsMomentum) {
    sim::WorldDefinition world = weightless();
    world.bodies = {ball({0, 0, 0}, sim::Fidelity::modal),
                    ball({0.99, 0.05, 0}, sim::Fidelity::modal, 0.5, 300)};
    world.bodies[0].velocity = {0.3, 0, 0.1};
    world.bodies[1].angular_velocity = {1, 2, 3};
    SolverIsland test(world);
    const Eigen::Vector3d linear = test.momentum(), angular = test.angular_momentum();
    sweep(test);
    EXPECT_LT((test.momentum() - linear).norm(), 1e-13 * linear.norm());
    EXPECT_LT((test.angular_momentum() - angular).norm(), 1e-12 * angular.norm());
}

}  // namespace
