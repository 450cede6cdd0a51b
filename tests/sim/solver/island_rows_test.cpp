// What rows see of velocities, and how impulses along them act.
#include "solver/island_rows.h"

#include <gtest/gtest.h>

#include "solver/contact_kernel.h"
#include "solver_island.h"

namespace {

using namespace world_test;

/// Two balls of 1 and 4 times the mass that touch along x, the first moving.
sim::WorldDefinition two_balls(sim::Fidelity fidelity = sim::Fidelity::rigid) {
    sim::WorldDefinition world = weightless();
    world.bodies = {ball({0, 0, 0}, fidelity), ball({0.999, 0, 0}, fidelity, 0.5, 400)};
    world.bodies[0].velocity = {0.2, 0.1, 0};
    world.bodies[1].angular_velocity = {0, 0, 2};
    return world;
}

TEST(IslandRows, TheMobilityOfTwoBallsIsThatOfTheirMassesAndLevers) {
    SolverIsland test(two_balls());
    const sim::IslandRows& rows = test.begin();
    ASSERT_EQ(rows.contacts.size(), 1u);
    const sim::ContactRows& c = rows.contacts[0];
    double normal = 0, tangent = 0;
    for (const sim::MovingBody& b : test.bodies) {
        normal += 1 / b.kind->mass.mass;
        // A ball's lever is its radius, less half of the overlap of 1 mm.
        tangent += 1 / b.kind->mass.mass + 0.4995 * 0.4995 / b.kind->mass.inertia[0];
    }
    const double single = 2e-6;  // share: rows are in single precision
    EXPECT_NEAR(c.k[0][0], normal, single * normal);
    EXPECT_NEAR(c.k[1][1], tangent, single * tangent);
    EXPECT_NEAR(c.k[2][2], tangent, single * tangent);
    EXPECT_NEAR(c.k[0][1], 0, single * tangent);
}

TEST(IslandRows, SeeTheSpeedOfSurfacesAgainstEachOther) {
    SolverIsland test(two_balls());
    sim::IslandRows& rows = test.begin();
    for (sim::BodyRows& body : rows.bodies) rows.load_velocities(body);
    const sim::ContactRows& c = rows.contacts[0];
    float v[3];
    sim::speeds(rows, c, v);
    // Normal from the second ball to the first: -x. The second's surface moves down there at 2 rad/s x 0.4995 m.
    const Eigen::Vector3d apart(0.2, 0.1 + 2 * 0.4995, 0);
    EXPECT_NEAR(v[0], -0.2, 1e-6);
    EXPECT_NEAR(v[1], apart.dot(c.tangent[0].cast<double>()), 2e-6);
    EXPECT_NEAR(v[2], apart.dot(c.tangent[1].cast<double>()), 2e-6);
}

TEST(IslandRows, ImpulsesKeepLinearAndAngularMomentumToRounding) {
    SolverIsland test(two_balls(sim::Fidelity::modal));
    sim::IslandRows& rows = test.begin();
    const Eigen::Vector3d linear = test.momentum(), angular = test.angular_momentum();
    Eigen::Vector3d outside = Eigen::Vector3d::Zero();
    rows.apply(rows.contacts[0], {3.f, -1.f, 0.5f}, outside);
    EXPECT_GT((test.bodies[0].state.velocity - Eigen::Vector3d(0.2, 0.1, 0)).norm(), 0.01);
    EXPECT_LT((test.momentum() - linear).norm(), 1e-14 * linear.norm() + 1e-14);
    EXPECT_LT((test.angular_momentum() - angular).norm(), 1e-13 * angular.norm());
    EXPECT_EQ(outside, Eigen::Vector3d::Zero());
}

TEST(IslandRows, WhatAPlaneGivesCameFromOutside) {
    sim::WorldDefinition world = on_floor();
    world.bodies = {ball({0, 0.499, 0})};
    SolverIsland test(world);
    sim::IslandRows& rows = test.begin();
    ASSERT_EQ(rows.contacts.size(), 1u);
    Eigen::Vector3d outside = Eigen::Vector3d::Zero();
    rows.apply(rows.contacts[0], {3.f, 0.f, 0.f}, outside);
    EXPECT_LT((outside - Eigen::Vector3d(0, 3, 0)).norm(), 1e-6);  // the normal is in single precision
    EXPECT_LT((test.momentum() - outside).norm(), 1e-12);
}

}  // namespace
