#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "world_bodies.h"

// Bodies of prescribed motion: what they meet and hold sees their velocity.

using namespace world_test;
using sim::Fidelity;

namespace {

sim::MotionKey key(double time, const Eigen::Vector3d& position, double angle = 0,
                   const Eigen::Vector3d& axis = Eigen::Vector3d::UnitZ()) {
    return {time, position, Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis))};
}

}  // namespace

TEST(DrivenBodies, AreWhereTheirKeysSayAtTheEndOfEveryStep) {
    sim::WorldDefinition world = weightless();
    sim::WorldBody body = box({0, 0, 0}, {0.1, 0.2, 0.3});
    body.motion = {key(0.1, {1, 0, 0}), key(0.305, {1, 2, 0}, 1), key(0.5, {0, 2, 0}, -1)};
    world.bodies.push_back(body);
    sim::World w(world);
    EXPECT_EQ(w.state(0).position, Eigen::Vector3d(1, 0, 0));
    for (int k = 1; k <= 40; ++k) {
        w.step();
        const double t = k / 60.;
        Eigen::Vector3d expected(1, 0, 0);
        double angle = 0;
        if (t > 0.1)
            expected.y() = 2 * std::min(1., (t - 0.1) / 0.205), angle = std::min(1., (t - 0.1) / 0.205);
        if (t > 0.305)
            expected.x() = 1 - std::min(1., (t - 0.305) / 0.195),
            angle = 1 - 2 * std::min(1., (t - 0.305) / 0.195);
        EXPECT_LT((w.state(0).position - expected).norm(), 1e-12) << t;
        EXPECT_NEAR(2 * std::atan2(w.state(0).orientation.z(), w.state(0).orientation.w()), angle, 1e-9) << t;
    }
    EXPECT_EQ(w.momentum().norm(), 0);  // it has no part in that
}

// v' = (1 + e) u - e v for a paddle that moves at u. Rows are of single precision.
TEST(DrivenBodies, APaddleHitsABallAsInfiniteMassDoes) {
    for (const double size : {0.01, 1., 10.})
        for (const double dt : {1 / 30., 1 / 60., 1 / 480.})
            for (const double e : {0., 0.5, 1.})
                for (const double u : {1., 20.})
                    for (const double v : {0., -5., 0.5}) {
                        sim::WorldDefinition world = weightless();
                        world.settings.dt = dt, world.settings.sleeping = false;
                        sim::WorldBody paddle = box({0, 0, 0}, size * Eigen::Vector3d(0.2, 1, 1));
                        const double travel = 40 * size;
                        paddle.motion = {key(0, {0, 0, 0}), key(travel / u, {travel, 0, 0})};
                        sim::WorldBody round = ball({2.3 * size, 0, 0}, Fidelity::rigid, 0.5 * size, 1000);
                        round.restitution = e, round.velocity = {v, 0, 0};
                        world.bodies = {paddle, round};
                        sim::World w(world);
                        const double meets = (2.3 - 0.2 - 0.5) * size / (u - v);
                        run(w, static_cast<int>(meets / dt) + 3);
                        if (w.time_s() > travel / u) continue;
                        const double after = (1 + e) * u - e * v;
                        EXPECT_NEAR(w.state(1).velocity.x() / after, 1, 1e-5)
                            << size << ' ' << dt << ' ' << e << ' ' << u << ' ' << v;
                        EXPECT_LT(w.state(1).velocity.tail<2>().norm(), 1e-5 * after);
                    }
}

// A bar that turns about its centre: its matter moves at w x r where it hits.
TEST(DrivenBodies, ATurningBatHitsWithTheSpeedOfItsMatter) {
    for (const double dt : {1 / 60., 1 / 240.}) {
        sim::WorldDefinition world = weightless();
        world.settings.dt = dt;
        sim::WorldBody bat = box({0, 0, 0}, {1, 0.1, 0.2});
        bat.motion = {key(0, {0, 0, 0}), key(1, {0, 0, 0}, 3)};  // 3 rad/s
        sim::WorldBody round = ball({0.8, 0.35, 0}, Fidelity::rigid, 0.1, 1000);
        round.friction = 0, round.restitution = 1;
        world.bodies = {bat, round};
        sim::World w(world);
        run(w, static_cast<int>(0.5 / dt));
        // Frictionless: along the bat's normal as it hits, by twice the speed of the matter there; its angle a is where
        // the ball's distance from the bat's middle plane is 0.1 + 0.1.
        const double far = std::hypot(0.8, 0.35), a = std::atan2(0.35, 0.8) - std::asin(0.2 / far);
        const double speed = 2 * 3 * std::sqrt(far * far - 0.04);
        const Eigen::Vector3d expected = speed * Eigen::Vector3d(-std::sin(a), std::cos(a), 0);
        EXPECT_LT((w.state(1).velocity - expected).norm(), 0.02 * speed)
            << dt << ": " << w.state(1).velocity.transpose() << ", " << expected.transpose();
    }
}

// A belt at speed u takes a box to it at mu g, in u / (mu g).
TEST(DrivenBodies, ABeltCarriesABoxToItsSpeed) {
    for (const double size : {0.1, 1.})
        for (const double dt : {1 / 60., 1 / 240.})
            for (const Fidelity fidelity : {Fidelity::rigid, Fidelity::linear}) {
                // A linear box that slides by more than its height a step sinks into plates at rest, too.
                if (fidelity == Fidelity::linear && size < 1 && dt > 0.01) continue;
                const double u = 2 * std::sqrt(size), mu = 0.5, needs = u / (mu * 9.81);
                sim::WorldDefinition world;
                world.settings.dt = dt;
                sim::WorldBody belt = box({0, -0.5 * size, 0}, size * Eigen::Vector3d(30, 0.5, 1));
                belt.friction = mu;
                belt.motion = {key(0, {0, -0.5 * size, 0}), key(20 * size / u, {20 * size, -0.5 * size, 0})};
                sim::WorldBody load = box({0, 0.2 * size, 0}, size * Eigen::Vector3d(0.4, 0.2, 0.4), 500);
                load.friction = mu, load.fidelity.fidelity = fidelity, load.material.young_pa = 1e7;
                world.bodies = {belt, load};
                sim::World w(world);
                const int half = static_cast<int>(needs / 2 / dt);
                run(w, half);
                EXPECT_NEAR(w.state(1).velocity.x() / (mu * 9.81 * half * dt), 1, 0.03) << size << ' ' << dt;
                run(w, static_cast<int>(2 * needs / dt));
                EXPECT_NEAR(w.state(1).velocity.x() / u, 1, 1e-3)
                    << size << ' ' << dt << ' ' << int(fidelity);
                EXPECT_NEAR(w.state(1).position.y() / size, 0.2, 5e-3);
                EXPECT_FALSE(w.asleep(1));
                run(w, static_cast<int>(20 * size / u / dt) + 120);  // the belt has stopped
                EXPECT_TRUE(w.asleep(1));
            }
}

// A lift that starts under a sleeper wakes it and carries it up; slowly, too.
TEST(DrivenBodies, ALiftCarriesASleeperUp) {
    for (const double speed : {0.005, 0.5, 5.}) {
        sim::WorldDefinition world;
        sim::WorldBody lift = box({0, -0.1, 0}, {1, 0.1, 1});
        lift.motion = {key(0, {0, -0.1, 0}), key(2, {0, -0.1, 0}), key(3, {0, -0.1 + speed, 0})};
        world.bodies = {lift, box({0, 0.3, 0}, {0.3, 0.3, 0.3})};
        sim::World w(world);
        run(w, 119);
        EXPECT_TRUE(w.asleep(1));
        run(w, 60);
        EXPECT_NEAR(w.state(1).position.y(), 0.3 + w.state(0).position.y() + 0.1, 2e-3) << speed;
        EXPECT_FALSE(w.asleep(1));
    }
}

// A pendulum on a pivot that is moved at a steady speed swings as one on a pivot at rest, seen from the pivot; a hinge on a
// turning body turns with it.
TEST(DrivenBodies, JointsSeeTheirMotion) {
    for (const double stiffness : {1e8, std::numeric_limits<double>::infinity()}) {
        std::vector<Eigen::Vector3d> seen;
        for (const double speed : {0., 3.}) {
            sim::WorldDefinition world;
            sim::WorldBody pivot = ball({0, 0, 0}, Fidelity::rigid, 0.05),
                           bob = ball({0.5, 0, 0}, Fidelity::rigid, 0.1);
            pivot.motion = {key(0, {0, 0, 0}), key(2, {2 * speed, 0, 0})};
            bob.velocity = {speed, 0, 0};
            world.bodies = {pivot, bob};
            sim::PointConstraint rod;
            rod.body_a = 1, rod.point_a = {-0.5, 0, 0}, rod.body_b = 0, rod.stiffness = stiffness;
            world.constraints.push_back(rod);
            sim::World w(world);
            run(w, 90);
            seen.push_back(w.state(1).position - w.state(0).position);
        }
        EXPECT_LT((seen[0] - seen[1]).norm(), 1e-5) << stiffness;
    }
    sim::WorldDefinition world = weightless();
    sim::WorldBody arm = box({0, 0, 0}, {0.5, 0.05, 0.05}), load = box({1, 0, 0}, {0.4, 0.05, 0.05});
    arm.motion = {key(0, {0, 0, 0}), key(1, {0, 0, 0}, 2), key(2, {0, 0, 0}, 4)};
    load.velocity = {0, 2, 0}, load.angular_velocity = {0, 0, 2};
    world.bodies = {arm, load};
    sim::PointConstraint slide;  // along the arm
    slide.joint = sim::Joint::slider, slide.stiffness = std::numeric_limits<double>::infinity();
    slide.body_a = 1, slide.point_a = {-0.5, 0, 0}, slide.body_b = 0, slide.point_b = {0.5, 0, 0};
    world.constraints.push_back(slide);
    sim::World w(world);
    run(w, 60);
    // A bead on a rod that turns at w: r = r0 cosh(w t) without a radial speed at first.
    EXPECT_NEAR(w.state(1).position.norm() / std::cosh(2.), 1, 2e-3);
    EXPECT_NEAR(std::atan2(w.state(1).position.y(), w.state(1).position.x()), 2, 1e-5);
}

TEST(DrivenBodies, MotionsThatCannotBeAreRefused) {
    for (const auto& motion : {std::vector{key(1, {0, 0, 0}), key(1, {1, 0, 0})},
                               std::vector{key(-1, {0, 0, 0})}, std::vector{key(0, {std::nan(""), 0, 0})}}) {
        sim::WorldDefinition world = weightless();
        world.bodies.push_back(ball({0, 0, 0}));
        world.bodies[0].motion = motion;
        EXPECT_THROW(sim::World{world}, std::invalid_argument);
    }
}
