// Impacts within a substep.
#include "solver/impacts.h"

#include <gtest/gtest.h>

#include "solver_island.h"

namespace {

using namespace world_test;

/// The impacts of the first substep.
void strike(SolverIsland& test) {
    sim::IslandRows& rows = test.begin();
    sim::AppliedForces forces(rows);
    forces.begin_step(test.no_forces);
    sim::Impacts impacts(rows, forces);
    impacts.begin();
    for (sim::BodyRows& body : rows.bodies) rows.load_velocities(body);
    impacts.strike();
}

sim::WorldDefinition row_of_balls(int count, double e, double speed) {
    sim::WorldDefinition world = weightless();
    for (int i = 0; i < count; ++i) {
        world.bodies.push_back(ball({double(i), 0, 0}));
        world.bodies.back().restitution = e;
        world.bodies.back().friction = 0;
    }
    world.bodies[0].velocity = {speed, 0, 0};
    return world;
}

TEST(Impacts, ARowOfBallsHandsTheWholeImpulseOn) {
    for (const int count : {2, 3, 5, 9})
        for (const double speed : {0.5, 2.}) {
            SolverIsland test(row_of_balls(count, 1, speed));
            strike(test);
            for (int i = 0; i + 1 < count; ++i)
                EXPECT_NEAR(test.bodies[std::size_t(i)].state.velocity.x(), 0, 1e-3 * speed) << i;
            EXPECT_NEAR(test.bodies.back().state.velocity.x(), speed, 1e-3 * speed);
        }
}

TEST(Impacts, APairPartsWithERestitutionTimesItsApproach) {
    for (const double e : {0.2, 0.5, 0.9}) {
        SolverIsland test(row_of_balls(2, e, 2));
        strike(test);
        const double apart = test.bodies[1].state.velocity.x() - test.bodies[0].state.velocity.x();
        EXPECT_NEAR(apart, 2 * e, 1e-5);  // single precision
    }
}

TEST(Impacts, NoneGivesEnergyWhateverTheFrictionAndTheSpins) {
    Draw draw(7);
    for (int i = 0; i < 200; ++i) {
        sim::WorldDefinition world = weightless();
        const int count = 2 + draw.below(4);
        for (int k = 0; k < count; ++k) {
            world.bodies.push_back(ball({double(k), 0.2 * draw.between(-1, 1), 0}, sim::Fidelity::rigid, 0.5,
                                        draw.scale(50, 1000)));
            world.bodies.back().restitution = draw.between(0.1, 1);
            world.bodies.back().friction = draw.between(0, 1.5);
            world.bodies.back().angular_velocity = draw.between(0, 5) * draw.direction();
        }
        world.bodies[0].velocity = {draw.between(0.3, 3), draw.between(-1, 1), 0};
        SolverIsland test(world);
        const double before = test.kinetic_energy();
        const Eigen::Vector3d linear = test.momentum();
        strike(test);
        EXPECT_LE(test.kinetic_energy(), before * (1 + 1e-6)) << i;  // single precision
        EXPECT_LT((test.momentum() - linear).norm(), 1e-12 * linear.norm());
    }
}

}  // namespace
