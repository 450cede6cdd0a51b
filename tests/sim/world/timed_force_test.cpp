#include <gtest/gtest.h>

#include <cmath>

#include "world_bodies.h"

// Forces and impulses of a scene's schedule against closed forms.

using namespace world_test;
using sim::Fidelity;

namespace {

sim::TimedForce force_on(int body, const Eigen::Vector3d& force, double from, double until) {
    sim::TimedForce f;
    f.body = body, f.force = force, f.from_s = from, f.until_s = until;
    return f;
}

}  // namespace

// dv = J / m and dw = I^-1 (r x J), to rounding: a rigid body at rest does not turn while the impulse acts. At any time
// within a step; a linear body's rigid part takes the same.
TEST(TimedForces, AnImpulseAtAPointGivesItsMomentumAndItsMoment) {
    for (const double size : {0.01, 1., 10.})
        for (const double dt : {1 / 30., 1 / 480.})
            for (const double time : {0., 0.1, 0.1234})
                for (const Fidelity fidelity : {Fidelity::rigid, Fidelity::linear, Fidelity::modal}) {
                    sim::WorldDefinition world = weightless();
                    world.settings.dt = dt;
                    sim::WorldBody body = box({0, 0, 0}, size * Eigen::Vector3d(0.3, 0.2, 0.1), 1000);
                    body.fidelity.fidelity = fidelity, body.material.young_pa = 1e9;
                    world.bodies.push_back(body);
                    sim::TimedForce blow =
                        force_on(0, 100 * size * size * size * Eigen::Vector3d(1, 2, -3), time, time);
                    blow.point = size * Eigen::Vector3d(0.1, -0.1, 0.05);
                    world.forces.push_back(blow);
                    sim::World w(world);
                    for (int k = 0; k < static_cast<int>(time / dt); ++k) {
                        EXPECT_EQ(w.momentum().norm(), 0);
                        w.step();
                    }
                    w.step(), w.step();
                    const sim::RigidMass mass = w.rigid_mass(0);
                    EXPECT_LT((w.state(0).velocity - blow.force / mass.mass).norm(),
                              1e-9 * blow.force.norm() / mass.mass);
                    const double bends = fidelity == Fidelity::rigid ? 1e-9 : 1e-3;
                    const Eigen::Vector3d moment = blow.point.cross(blow.force);
                    EXPECT_LT((w.state(0).angular_momentum - moment).norm(), bends * moment.norm())
                        << size << ' ' << dt << ' ' << time;
                    EXPECT_LT((w.outside_impulse() - blow.force).norm(), 1e-9 * blow.force.norm());
                }
}

// m dv = F T and x as by a constant acceleration while it acts; begun and ended within substeps, at no step's border.
TEST(TimedForces, AForceOverASpanGivesForceTimesTime) {
    for (const double dt : {1 / 30., 1 / 100., 1 / 480.}) {
        const double from = 0.123, until = 0.789;
        sim::WorldDefinition world;
        world.settings.dt = dt, world.settings.sleeping = false;
        world.bodies.push_back(ball({0, 0, 0}));
        world.forces.push_back(force_on(0, {50, 0, 0}, from, until));
        sim::World w(world);
        const double mass = w.rigid_mass(0).mass, substep = dt / world.settings.substeps;
        run(w, static_cast<int>(std::lround(1 / dt)));
        const double v = 50 / mass * (until - from), t = w.time_s(), along = v * (t - (from + until) / 2);
        EXPECT_NEAR(w.state(0).velocity.x(), v, 1e-12 * v);
        EXPECT_NEAR(w.state(0).position.x(), along, v * substep) << dt;
        EXPECT_NEAR(w.state(0).velocity.y(), -9.81 * t, 1e-9);
        EXPECT_NEAR(w.state(0).position.y(), -9.81 / 2 * t * t, 1e-9);
    }
}

// A rocket: a force along the body's own axis turns with it.
TEST(TimedForces, AForceInTheBodysAxesTurnsWithIt) {
    sim::WorldDefinition world = weightless();
    world.bodies.push_back(ball({0, 0, 0}));
    world.bodies[0].angular_velocity = {0, 0, 2};
    sim::TimedForce rocket = force_on(0, {10, 0, 0}, 0, 1);
    rocket.turns = true;
    world.forces.push_back(rocket);
    sim::World w(world);
    run(w, 60);
    const double mass = w.rigid_mass(0).mass;
    // The integral of (cos 2t, sin 2t) over a second; its axes are those of each substep's start.
    const Eigen::Vector3d expected = 10 / mass / 2 * Eigen::Vector3d(std::sin(2.), 1 - std::cos(2.), 0);
    EXPECT_LT((w.state(0).velocity - expected).norm(), 2. / 240 * expected.norm());
}

TEST(TimedForces, WakeWhatSleepsAndItRestsAgain) {
    sim::WorldDefinition world = on_floor();
    world.bodies.push_back(box({0, 0.5, 0}, {0.5, 0.5, 0.5}));
    world.bodies[0].friction = 1;
    const double weight = 100 * 9.81;
    world.forces.push_back(force_on(0, {3 * weight, 0, 0}, 3, 3.2));
    world.forces.push_back(force_on(0, {0.1 * weight, 0, 0}, 6, 7));  // less than friction bears
    sim::World w(world);
    run(w, 170);
    EXPECT_TRUE(w.asleep(0));
    run(w, 40);
    EXPECT_FALSE(w.asleep(0));
    run(w, 140);
    EXPECT_TRUE(w.asleep(0));
    const double x = w.state(0).position.x();
    EXPECT_GT(x, 0.05);
    run(w, 30);
    EXPECT_FALSE(w.asleep(0));
    run(w, 120);
    EXPECT_TRUE(w.asleep(0));
    EXPECT_NEAR(w.state(0).position.x(), x, 1e-3);
}

TEST(TimedForces, ThatCannotBeAreRefused) {
    sim::WorldDefinition world = weightless();
    world.bodies.push_back(ball({0, 0, 0}));
    for (const sim::TimedForce& bad : {force_on(-1, {1, 0, 0}, 0, 1), force_on(0, {std::nan(""), 0, 0}, 0, 1),
                                       force_on(0, {1, 0, 0}, 2, 1), force_on(0, {1, 0, 0}, -1, 1)}) {
        world.forces = {bad};
        EXPECT_THROW(sim::World{world}, std::invalid_argument);
    }
}
