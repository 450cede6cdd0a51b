#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "world_bodies.h"

// Contact between bodies that cross their own size within a step: nothing is missed, nothing is invented.

using namespace world_test;
using Eigen::Vector3d;
using sim::Fidelity;

namespace {

sim::WorldDefinition any_step(Draw& draw) {
    constexpr double kSteps[] = {1.0 / 30, 1.0 / 60, 1.0 / 120, 1.0 / 480};
    constexpr int kSubsteps[] = {1, 2, 4, 7};
    sim::WorldDefinition d = weightless();
    d.settings.dt = kSteps[draw.below(4)];
    d.settings.substeps = kSubsteps[draw.below(4)];
    return d;
}

Fidelity any_fidelity(Draw& draw) {
    constexpr Fidelity kChoices[] = {Fidelity::rigid, Fidelity::rigid, Fidelity::linear, Fidelity::modal};
    return kChoices[draw.below(4)];
}

sim::WorldBody frictionless(sim::WorldBody body) {
    body.friction = 0;
    return body;
}

/// Within 45 degrees or so of x.
Vector3d towards_a_wall(Draw& draw) {
    return Vector3d(1, draw.between(-0.7, 0.7), draw.between(-0.7, 0.7)).normalized();
}

/// Whether the centre of a body that flies at a wall across x comes to `x` within so many steps, before it is farther than
/// `slid_off` from the wall's middle.
bool comes_to(sim::World& world, int body, double x, double slid_off, int steps) {
    for (int k = 0; k < steps; ++k) {
        world.step();
        const Vector3d p = world.state(body).position;
        if (std::max(std::abs(p.y()), std::abs(p.z())) > slid_off) return false;
        if (p.x() >= x) return true;
    }
    return false;
}

TEST(WorldImpact, BallsDroppedOnAWideThinTableStayOnIt) {
    sim::WorldDefinition d;
    d.bodies.push_back(box({0, 0, 0}, {1, 0.02, 1}));
    d.bodies[0].fixed = true;
    for (int i = 0; i < 25; ++i)
        d.bodies.push_back(
            ball({0.35 * (i % 5 - 2) + 0.01, 2, 0.35 * (i / 5 - 2) - 0.005}, Fidelity::rigid, 0.04, 1000));
    sim::World world(d);
    run(world, 180);
    for (int i = 1; i <= 25; ++i) {
        EXPECT_GT(world.state(i).position.y(), 0.0590) << i;
        EXPECT_LT(world.state(i).position.y(), 0.0605) << i;
    }
    EXPECT_GE(world.counts().impacts, 25u);
}

TEST(WorldImpact, CardsAndNeedlesOfOneCentimetreStopAtAWallOfFiveAt50To300MetresASecond) {
    for (const double speed : {50.0, 150.0, 300.0})
        for (const Vector3d& half : {Vector3d(0.005, 0.1, 0.1), Vector3d(0.005, 0.1, 0.005)})
            for (const bool wall_first : {true, false}) {
                sim::WorldDefinition d = weightless();
                sim::WorldBody wall = box({0, 0, 0}, {0.025, 1, 1}),
                               card = box({-1.4, 0.1, 0.05}, half, 1000);
                wall.fixed = true;
                card.velocity = {speed, 0, 0};
                d.bodies = wall_first ? std::vector{wall, card} : std::vector{card, wall};
                sim::World world(d);
                run(world, 12);
                const sim::WorldBodyState s = world.state(wall_first ? 1 : 0);
                EXPECT_LT(s.position.x(), -0.029) << speed << " m/s";
                EXPECT_GT(s.position.x(), -0.12) << speed;
                EXPECT_LT(s.velocity.norm(), 0.01 * speed) << speed;
            }
}

// A needle that has hit a wall with one end, at e = 0, turns by several radians a step: its other end hits, too.
TEST(WorldImpact, RigidNeedlesAndCardsThatTurnOnDoNotPassWalls) {
    Draw draw(11);
    int through = 0;
    constexpr int kCases = 300;
    for (int i = 0; i < kCases; ++i) {
        sim::WorldDefinition d = any_step(draw);
        const double s = draw.scale(0.01, 10), speed = draw.scale(50, 300), half = s * draw.scale(0.03, 0.3);
        sim::WorldBody wall = box({0, 0, 0}, {half, 5 * s, 5 * s}),
                       shot = box({0, 0, 0}, {s / 20, s, draw.below(2) ? s : s / 20});
        wall.fixed = true;
        const Vector3d way = towards_a_wall(draw);
        const Vector3d aim(-half - 1.5 * s, draw.between(-1, 1) * s, draw.between(-1, 1) * s);
        shot.world_from_body.linear() =
            Eigen::AngleAxisd(draw.between(0, 3), draw.direction()).toRotationMatrix();
        shot.world_from_body.translation() = aim - draw.between(0.1, 2) * speed * d.settings.dt * way;
        shot.velocity = speed * way;
        d.bodies = {wall, shot};
        sim::World world(d);
        through += comes_to(world, 1, 0, 3.5 * s, 12);
    }
    // Of bodies that once are inside a thin wall no sample tells which way is out.
    EXPECT_LE(through, kCases / 100);
}

TEST(WorldImpact, BallsOf1CmTo10MAt1To300MetresASecondDoNotPassWalls) {
    Draw draw(1);
    for (int i = 0; i < 150; ++i) {
        sim::WorldDefinition d = any_step(draw);
        const double r = draw.scale(0.01, 10), speed = draw.scale(1, 300), half = r * draw.scale(0.05, 0.5);
        const bool wall_first = draw.below(2) == 0;
        sim::WorldBody wall = box({0, 0, 0}, {half, 6 * r, 6 * r});
        wall.fixed = true;
        const Vector3d way = towards_a_wall(draw);
        const Vector3d aim(-half - r, draw.between(-2, 2) * r, draw.between(-2, 2) * r);
        sim::WorldBody shot =
            ball(aim - draw.between(0.1, 2) * speed * d.settings.dt * way, Fidelity::rigid, r);
        shot.velocity = speed * way;
        shot.angular_velocity = draw.below(2) * draw.between(0, 20) / r * draw.direction();
        d.bodies = wall_first ? std::vector{wall, shot} : std::vector{shot, wall};
        sim::World world(d);
        ASSERT_FALSE(comes_to(world, wall_first ? 1 : 0, -half - 0.8 * r, 6 * r, 6))
            << "case " << i << ", r " << r << " at " << speed << " m/s";
    }
}

// Modes describe no impact faster than sound in the matter: the centre would run on through the wall while they yield.
TEST(WorldImpact, SoftBodiesFasterThanSoundInTheirMatterDoNotPassWalls) {
    Draw draw(12);
    for (int i = 0; i < 200; ++i) {
        sim::WorldDefinition d = any_step(draw);
        const double s = draw.scale(0.01, 3), sound = draw.scale(3, 300),
                     speed = std::min(300., sound * draw.scale(1, 20)), half = s * draw.scale(0.05, 0.5);
        sim::WorldBody wall = box({0, 0, 0}, {half, 6 * s, 6 * s});
        wall.fixed = true;
        const Fidelity fidelity = draw.below(2) ? Fidelity::linear : Fidelity::modal;
        sim::WorldBody shot = ball({0, 0, 0}, fidelity, s);
        if (draw.below(2)) {
            shot = box({0, 0, 0}, {s * draw.scale(0.05, 1), s, s});
            shot.fidelity.fidelity = fidelity;
        }
        shot.material.young_pa = shot.material.density_kg_m3 * sound * sound;
        const Vector3d way = towards_a_wall(draw);
        shot.world_from_body.translation() =
            Vector3d(-half - 1.8 * s, 0, 0) - draw.between(0.1, 2) * speed * d.settings.dt * way;
        shot.velocity = speed * way;
        d.bodies = {wall, shot};
        sim::World world(d);
        ASSERT_FALSE(comes_to(world, 1, -half, 5 * s, 12))
            << "case " << i << ", size " << s << " at " << speed << " m/s, " << speed / sound
            << " times sound";
    }
}

TEST(WorldImpact, ABallThatPassesAnotherByOnePercentOfItsRadiusKeepsItsVelocityToTheLastBit) {
    Draw draw(2);
    for (int i = 0; i < 200; ++i) {
        sim::WorldDefinition d = any_step(draw);
        const double r = draw.scale(0.01, 10), other = r * draw.scale(0.3, 4), speed = draw.scale(1, 300);
        const double clear = std::min(r, other) * (draw.below(2) ? 0.0105 : draw.scale(0.011, 3));
        const Vector3d way = draw.direction(), aside = way.unitOrthogonal();
        const double before = draw.between(1, 3) * (r + other) + draw.between(0, 1) * speed * d.settings.dt;
        sim::WorldBody post = ball({0, 0, 0}, Fidelity::rigid, other),
                       shot = ball((r + other + clear) * aside - before * way, any_fidelity(draw), r);
        post.fixed = draw.below(2) == 0;
        shot.velocity = speed * way;
        const bool first = draw.below(2) == 0;
        d.bodies = first ? std::vector{shot, post} : std::vector{post, shot};
        sim::World world(d);
        run(world, static_cast<int>(2 * before / speed / d.settings.dt) + 2);
        ASSERT_EQ(world.state(first ? 0 : 1).velocity, shot.velocity) << "case " << i;
        ASSERT_EQ(world.state(first ? 1 : 0).velocity, Vector3d(Vector3d::Zero())) << "case " << i;
    }
}

TEST(WorldImpact, ObliqueReboundsOfRigidBallsAreRightToHalfADegree) {
    Draw draw(3);
    for (int i = 0; i < 200; ++i) {
        sim::WorldDefinition d = any_step(draw);
        const double r = draw.scale(0.01, 5), other = r * draw.scale(0.3, 4), speed = draw.scale(1, 300);
        const double aside = draw.between(0, 0.95);
        const Vector3d way = draw.direction();
        const Vector3d normal = aside * way.unitOrthogonal() - std::sqrt(1 - aside * aside) * way;
        d.bodies.push_back(frictionless(ball({0, 0, 0}, Fidelity::rigid, other)));
        d.bodies[0].fixed = true;
        d.bodies.push_back(frictionless(ball(
            (r + other) * normal - draw.between(0.1, 4) * speed * d.settings.dt * way, Fidelity::rigid, r)));
        d.bodies[1].velocity = speed * way;
        d.bodies[1].restitution = 1;
        sim::World world(d);
        run(world, 8);
        const Vector3d out = world.state(1).velocity / speed, expected = way - 2 * way.dot(normal) * normal;
        EXPECT_LT((out - expected).norm(), std::numbers::pi / 360) << "case " << i << ", aside " << aside;
        EXPECT_NEAR((out - out.dot(normal) * normal).norm(), (way - way.dot(normal) * normal).norm(), 0.01);
    }
}

TEST(WorldImpact, WhatABallPushesAheadDoesNotPassWhatIsBehind) {
    Draw draw(4);
    for (int i = 0; i < 60; ++i) {
        sim::WorldDefinition d = weightless();
        const double r = draw.scale(0.01, 1);
        double x = 0;
        const int balls = 2 + draw.below(3);
        for (int k = 0; k < balls; ++k) {
            d.bodies.push_back(ball({x, 0, 0}, Fidelity::rigid, r));
            x += 2 * r + draw.scale(0.05, 3) * r;
        }
        d.bodies[0].velocity = {draw.scale(5, 200), 0, 0};
        d.bodies.push_back(box({x, 0, 0}, {0.1 * r, 10 * r, 10 * r}));
        d.bodies.back().fixed = true;
        sim::World world(d);
        for (int step = 0; step < 120; ++step) {
            world.step();
            for (int k = 0; k < balls; ++k)
                ASSERT_LT(world.state(k).position.x(), world.state(k + 1).position.x())
                    << "case " << i << ", ball " << k << ", step " << step;
        }
    }
}

TEST(WorldImpact, AStiffModalBallRollsDownASlopeAsARigidOne) {
    for (const Fidelity fidelity : {Fidelity::rigid, Fidelity::linear, Fidelity::modal}) {
        sim::WorldDefinition d;
        d.settings.sleeping = false;
        const double slope = 10 * std::numbers::pi / 180;
        const Vector3d normal(std::sin(slope), std::cos(slope), 0);
        d.planes.push_back({.normal = normal});
        d.bodies.push_back(ball(0.2 * normal, fidelity, 0.2, 1000));
        d.bodies[0].material.young_pa = 1e10;
        sim::World world(d);
        run(world, 120);
        EXPECT_NEAR(world.state(0).velocity.norm() / (2 * 5 / 7.0 * 9.81 * std::sin(slope)), 1, 0.01);
    }
}

}  // namespace
