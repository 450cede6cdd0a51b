#include <gtest/gtest.h>

#include <cmath>

#include "world_bodies.h"

using namespace world_test;
using sim::Fidelity;

TEST(WorldContact, BodiesPutDeepIntoEachOtherPartWithoutGainingEnergy) {
    for (const Fidelity fidelity : {Fidelity::rigid, Fidelity::modal})
        for (const double distance : {0.0, 0.05, 0.15, 0.3, 0.5, 0.8}) {
            sim::WorldDefinition definition = weightless();
            definition.settings.sleeping = false;
            definition.bodies.push_back(ball({0, 0, 0}, fidelity));
            definition.bodies.push_back(ball({distance, 0, 0}, fidelity));
            sim::World world(definition);
            for (int k = 0; k < 300; ++k) {
                world.step();
                ASSERT_LT(world.energy().total(), 1e-2) << distance << " m, step " << k;
            }
            // Samples of a ball lie up to 1 % deeper than its surface between them.
            EXPECT_GT((world.state(1).position - world.state(0).position).norm(), 0.96) << distance;
        }
}

TEST(WorldContact, ASmallBodyALittleInsideALargeOneComesOutByTheNearestSide) {
    // A ball of 5 cm, 1 cm deep in the top of a slab of 2 m, far from its middle.
    sim::WorldDefinition definition = weightless();
    definition.bodies.push_back(box({0, 0, 0}, {1, 0.5, 1}));
    definition.bodies[0].fixed = true;
    definition.bodies.push_back(ball({0.6, 0.54, 0.2}, Fidelity::rigid, 0.05));
    sim::World world(definition);
    run(world, 120);
    EXPECT_GT(world.state(1).position.y(), 0.548);
    EXPECT_NEAR(world.state(1).position.x(), 0.6, 1e-3);
    EXPECT_NEAR(world.state(1).position.z(), 0.2, 1e-3);
}

TEST(WorldContact, ABodyTooSoftForItsWeightStaysOnTheFloor) {
    for (const double young : {1e3, 1e4, 2e4})
        for (const int modes : {12, 40, 75}) {
            sim::WorldDefinition definition = on_floor();
            definition.bodies.push_back(ball({0, 1.2, 0}, Fidelity::modal, 0.4, 1000));
            definition.bodies[0].material.young_pa = young;
            definition.bodies[0].fidelity.modes = modes;
            sim::World world(definition);
            run(world, 600);
            EXPECT_GT(world.state(0).position.y(), 0.12) << young << " Pa, " << modes << " modes";
            EXPECT_GT(world.counts().deformations_limited, 0u);
        }
}

TEST(WorldContact, TenBoxesOfOneMetreStandForAMinuteAndDriftLessThanAMillimetre) {
    sim::WorldDefinition definition = on_floor();
    definition.settings.sleeping = false;
    for (int i = 0; i < 10; ++i)
        definition.bodies.push_back(box({0, 0.5 + i, 0}, Eigen::Vector3d::Constant(0.5), 1000));
    sim::World world(definition);
    run(world, 480);  // contacts settle to their static depth
    std::vector<Eigen::Vector3d> start;
    for (int i = 0; i < 10; ++i) start.push_back(world.state(i).position);
    for (int k = 0; k < 3600; ++k) {
        world.step();
        for (int i = 0; i < 10; ++i)
            ASSERT_LT((world.state(i).position - start[static_cast<std::size_t>(i)]).norm(), 1e-3)
                << "box " << i << " at step " << k;
    }
    EXPECT_LT(world.energy().kinetic, 1e-6) << "of 5 MJ of potential energy";
    // Overlap at rest: g / (2 pi 30 Hz)^2 = 0.28 mm a box that is carried, so 55 x 0.28 mm at the top at
    // most.
    EXPECT_NEAR(world.state(9).position.y(), 9.5, 0.016);
}

TEST(WorldContact, ABodyAHundredTimesHeavierRestsOnALightOne) {
    sim::WorldDefinition definition = on_floor();
    definition.settings.sleeping = false;
    definition.bodies.push_back(box({0, 0.5, 0}, Eigen::Vector3d::Constant(0.5), 100));
    definition.bodies.push_back(box({0, 1.5, 0}, Eigen::Vector3d::Constant(0.5), 10000));
    sim::World world(definition);
    run(world, 1200);
    const double top = world.state(1).position.y();
    run(world, 600);
    EXPECT_NEAR(world.state(1).position.y(), top, 1e-3) << "settled";
    EXPECT_LT(world.state(1).velocity.norm(), 1e-3);
    // The contact's spring is tuned to the light body, so the heavy one sinks in by some centimetres.
    EXPECT_GT(top, 1.4);
}

TEST(WorldContact, MassRatioOfAMillionStaysFiniteAndAboveTheFloor) {
    sim::WorldDefinition definition = on_floor();
    definition.bodies.push_back(box({0, 0.5, 0}, Eigen::Vector3d::Constant(0.5), 100));
    definition.bodies.push_back(box({0.1, 1.5, 0}, Eigen::Vector3d::Constant(0.5), 1e8));
    sim::World world(definition);
    for (int k = 0; k < 1200; ++k) {
        world.step();
        for (int i = 0; i < 2; ++i) {
            ASSERT_TRUE(world.state(i).position.allFinite());
            ASSERT_LT(world.state(i).velocity.norm(), 100) << k;
        }
    }
    EXPECT_TRUE(world.quarantined().empty());
    EXPECT_GT(world.state(1).position.y(), 0.4);
}

class WorldOverlap : public testing::TestWithParam<Fidelity> {};

TEST_P(WorldOverlap, ABodyStartedHalfInsideAnotherLeavesSlowlyAndGainsNoEnergy) {
    sim::WorldDefinition definition = weightless();
    definition.settings.sleeping = false;
    definition.bodies.push_back(ball({0, 0, 0}, GetParam()));
    definition.bodies.push_back(ball({0.5, 0.1, 0}, GetParam()));
    sim::World world(definition);
    double before = (world.state(1).position - world.state(0).position).norm();
    for (int k = 0; k < 300; ++k) {
        world.step();
        const double apart = (world.state(1).position - world.state(0).position).norm();
        ASSERT_LT((apart - before) / definition.settings.dt, 3.0) << "m/s apart at step " << k;
        before = apart;
        // 52 kg each: a joule is 0.14 m/s. Nothing was moving, so all energy would be a gain.
        ASSERT_LT(world.energy().total(), 1e-3) << "J at step " << k;
    }
    // Samples of a ball lie up to 1 % deeper than its surface between them.
    EXPECT_GT(before, 0.97) << "they have left each other";
}

INSTANTIATE_TEST_SUITE_P(Each, WorldOverlap,
                         testing::Values(Fidelity::rigid, Fidelity::linear, Fidelity::modal));

class WorldRestitution : public testing::TestWithParam<double> {};

TEST_P(WorldRestitution, IsAsAskedOnAFloorAndBetweenBodies) {
    const double e = GetParam();
    sim::WorldDefinition on_plane = weightless();
    on_plane.planes.push_back({});
    on_plane.bodies.push_back(ball({0, 1, 0}));
    on_plane.bodies[0].velocity = {0, -3, 0};
    on_plane.bodies[0].restitution = e;
    sim::World floor(on_plane);
    run(floor, 60);
    EXPECT_NEAR(floor.state(0).velocity.y() / 3, e, 1e-2);

    sim::WorldDefinition head_on = weightless();
    for (const double side : {-1.0, 1.0}) {
        head_on.bodies.push_back(ball({0, side, 0}));
        head_on.bodies.back().velocity = {0, -2 * side, 0};
        head_on.bodies.back().restitution = e;
    }
    sim::World pair(head_on);
    run(pair, 60);
    EXPECT_NEAR((pair.state(1).velocity.y() - pair.state(0).velocity.y()) / 4, e, 1e-2);
    EXPECT_NEAR(pair.momentum().norm(), 0, 1e-12) << "of 105 kg m/s a body";
}

INSTANTIATE_TEST_SUITE_P(Each, WorldRestitution, testing::Values(0.0, 0.25, 0.5, 0.75, 1.0));

TEST(WorldContact, ADroppedBallReboundsWithHalfItsSpeed) {
    sim::WorldDefinition definition = on_floor();
    definition.bodies.push_back(ball({0, 2, 0}));
    definition.bodies[0].restitution = 0.5;
    sim::World world(definition);
    double up = 0;
    for (int k = 0; k < 200 && up <= 0; ++k) {
        world.step();
        up = world.state(0).velocity.y();
    }
    // It rebounds within a step: what it rose by until the step's end belongs to the speed at the floor.
    const double rebound = std::sqrt(up * up + 2 * 9.81 * (world.state(0).position.y() - 0.5));
    EXPECT_NEAR(rebound / std::sqrt(2 * 9.81 * 1.5), 0.5, 0.005);
}

class WorldFriction : public testing::TestWithParam<double> {};

TEST_P(WorldFriction, ASlidingBlockStopsWhereCoulombSays) {
    const double mu = GetParam();
    for (const double speed : {3.0, 5.0}) {
        sim::WorldDefinition definition = on_floor();
        definition.planes[0].friction = mu;
        definition.bodies.push_back(box({0, 0.2, 0}, {0.5, 0.2, 0.5}));
        definition.bodies[0].friction = mu;
        definition.bodies[0].velocity = {speed, 0, 0};
        definition.settings.substeps = 8;
        sim::World world(definition);
        run(world, 900);
        const double stop = speed * speed / (2 * mu * 9.81);
        EXPECT_NEAR(world.state(0).position.x() / stop, 1, 0.01) << "mu " << mu << " at " << speed << " m/s";
        EXPECT_LT(world.state(0).velocity.norm(), 1e-6);
    }
}

INSTANTIATE_TEST_SUITE_P(Each, WorldFriction, testing::Values(0.1, 0.2, 0.4, 0.6));

TEST(WorldContact, OnASlopeABlockStaysBelowTheAngleOfFrictionAndSlidesAboveIt) {
    const double mu = 0.5;
    for (const double angle : {0.9 * std::atan(mu), 1.2 * std::atan(mu)}) {
        sim::WorldDefinition definition = on_floor();
        definition.settings.gravity = 9.81 * Eigen::Vector3d(std::sin(angle), -std::cos(angle), 0);
        definition.planes[0].friction = mu;
        definition.bodies.push_back(box({0, 0.1, 0}, {0.5, 0.1, 0.5}));
        definition.bodies[0].friction = mu;
        sim::World world(definition);
        run(world, 120);
        const double free_slide = 0.5 * 9.81 * (std::sin(angle) - mu * std::cos(angle)) * 4;
        if (angle < std::atan(mu)) {
            EXPECT_NEAR(world.state(0).position.x(), 0, 1e-3);
        } else {
            EXPECT_NEAR(world.state(0).position.x() / free_slide, 1, 0.02);
        }
    }
}

TEST(WorldContact, CollisionsKeepMomentumAndNeverAddEnergy) {
    for (const Fidelity fidelity : {Fidelity::rigid, Fidelity::linear, Fidelity::modal}) {
        sim::WorldDefinition definition = weightless();
        definition.settings.sleeping = false;
        for (int i = 0; i < 8; ++i) {
            definition.bodies.push_back(ball({i % 2 - 0.5, i / 2 % 2 - 0.5, i / 4 - 0.5}, fidelity, 0.45));
            sim::WorldBody& body = definition.bodies.back();
            body.world_from_body.translation() *= 3;
            body.velocity =
                -2 * body.world_from_body.translation() + Eigen::Vector3d(0.1 * i, 0.2, -0.05 * i);
            body.angular_velocity = {0.3 * i, 1, -0.2 * i};
            body.restitution = 0.5;
        }
        sim::World world(definition);
        const Eigen::Vector3d momentum = world.momentum(), turn = world.angular_momentum();
        double energy = world.energy().total();
        const double start = energy;
        for (int k = 0; k < 300; ++k) {
            world.step();
            // Single precision in the contact: 1e-6 of the energy a step.
            ASSERT_LT(world.energy().total(), energy + 1e-5 * start) << "step " << k;
            energy = world.energy().total();
        }
        EXPECT_LT(energy, 0.9 * start) << "they have collided";
        const double scale = 8 * 38 * 3.0;  // kg m/s in motion
        // Impulses act in double precision and at one point a pair.
        EXPECT_LT((world.momentum() - momentum).norm(), 1e-12 * scale);
        // Restitution comes after the move of the last substep, so centres have moved a little askew.
        EXPECT_LT((world.angular_momentum() - turn).norm(), 5e-3 * scale);
    }
}

TEST(WorldContact, ACommonVelocityOfFiftyMetresASecondChangesNothing) {
    // Two boxes, one on the other, without friction on the floor: seen from the moving frame nothing happens.
    sim::WorldDefinition definition = on_floor();
    definition.settings.sleeping = false;
    definition.planes[0].friction = 0;
    for (int i = 0; i < 2; ++i) {
        definition.bodies.push_back(box({0, 0.5 + i, 0}, Eigen::Vector3d::Constant(0.5)));
        definition.bodies.back().velocity = {50, 0, 0};
    }
    sim::World world(definition);
    run(world, 300);
    for (int i = 0; i < 2; ++i) {
        EXPECT_NEAR(world.state(i).position.x(), 50 * 5, 1e-3);
        EXPECT_NEAR(world.state(i).position.y(), 0.5 + i, 3e-3);
        EXPECT_NEAR(world.state(i).velocity.x(), 50, 1e-3);
        EXPECT_LT(world.state(i).angular_momentum.norm(), 1e-2) << "of 17 kg m^2: 1e-3 rad/s";
    }
}

TEST(WorldContact, ABallRollsForTenSecondsWithoutGainingSpeed) {
    for (const double speed : {2.0, 10.0, 20.0}) {
        sim::WorldDefinition definition = on_floor();
        definition.settings.sleeping = false;
        definition.bodies.push_back(ball({0, 0.5, 0}));
        definition.bodies[0].velocity = {speed, 0, 0};
        definition.bodies[0].angular_velocity = {0, 0, -speed / 0.5};
        sim::World world(definition);
        const double start = world.energy().kinetic;
        double most = 0;
        for (int k = 0; k < 600; ++k) {
            world.step();
            most = std::max(most, world.energy().total() - world.rigid_mass(0).mass * 9.81 * 0.5);
        }
        // A ball over a plane touches with its lowest point, not with its samples only.
        EXPECT_LT(most / start, 1.001) << speed;
        EXPECT_NEAR(world.state(0).velocity.x() / speed, 1, 0.01) << speed;
        EXPECT_NEAR(world.state(0).position.x() / (speed * 10), 1, 0.01) << speed;
    }
}

TEST(WorldContact, SoftBodiesReboundWithoutGainingEnergy) {
    for (const double young : {2e4, 2e5, 1e6})
        for (const double e : {0.0, 0.6, 1.0}) {
            sim::WorldDefinition definition = weightless();
            definition.settings.sleeping = false;
            definition.planes.push_back({});
            definition.bodies.push_back(ball({0, 0.7, 0}, Fidelity::modal));
            definition.bodies[0].material.young_pa = young;
            definition.bodies[0].damping_ratio = 0;
            definition.bodies[0].velocity = {0, -3, 0};
            definition.bodies[0].restitution = e;
            sim::World world(definition);
            const double start = world.energy().total();
            for (int k = 0; k < 120; ++k) {
                world.step();
                ASSERT_LT(world.energy().total(), 1.01 * start) << young << " Pa, e " << e << ", step " << k;
            }
            EXPECT_GT(world.state(0).velocity.y(), 0.05) << "it has come back";
        }
}

TEST(WorldContact, FastBodiesDoNotPassThroughAThinWall) {
    for (const double speed : {5.0, 10.0, 20.0, 40.0, 80.0}) {
        sim::WorldDefinition definition = weightless();
        definition.bodies.push_back(box({0, 0, 0}, {0.05, 1, 1}));
        definition.bodies[0].fixed = true;
        definition.bodies.push_back(ball({-3, 0.1, 0.05}, Fidelity::rigid, 0.1));
        definition.bodies[1].velocity = {speed, 0, 0};
        sim::World world(definition);
        run(world, 120);
        EXPECT_LT(world.state(1).position.x(), -0.12) << speed << " m/s";
    }
}
