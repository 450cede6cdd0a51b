#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>

#include "body/body_kind.h"
#include "world_bodies.h"

using namespace world_test;
using sim::Fidelity;

namespace {

sim::WorldDefinition pile(int bodies, Fidelity fidelity) {
    sim::WorldDefinition definition = on_floor();
    for (int i = 0; i < bodies; ++i) {
        definition.bodies.push_back(ball({0.13 * (i % 3), 0.7 + 1.1 * i, 0.17 * (i % 2)}, fidelity));
        definition.bodies.back().angular_velocity = {0.1 * i, 0, 0.3};
    }
    for (const double side : {-1.0, 1.0}) {
        definition.planes.push_back({Eigen::Vector3d(side, 0, 0), -1.2});
        definition.planes.push_back({Eigen::Vector3d(0, 0, side), -1.2});
    }
    return definition;
}

bool same(const sim::WorldBodyState& a, const sim::WorldBodyState& b) {
    return a.position == b.position && a.orientation.coeffs() == b.orientation.coeffs() &&
           a.velocity == b.velocity && a.angular_momentum == b.angular_momentum && a.q == b.q &&
           a.q_dot == b.q_dot;
}

long resident_pages() {
    long all = 0, resident = 0;
    std::ifstream("/proc/self/statm") >> all >> resident;
    return resident;
}

bool long_run() {
    return std::getenv("MUSICWORLD_LONG") != nullptr;
}

}  // namespace

TEST(World, StateAfterAThousandStepsHasTheSameHashOnEveryRun) {
    std::uint64_t first = 0;
    for (int i = 0; i < 3; ++i) {
        sim::World world(pile(8, Fidelity::modal));
        run(world, 1000);
        if (i == 0) first = world.state_hash();
        EXPECT_EQ(world.state_hash(), first);
    }
    sim::WorldDefinition other = pile(8, Fidelity::modal);
    other.bodies[0].velocity.x() = 1e-9;
    sim::World world(other);
    run(world, 1000);
    EXPECT_NE(world.state_hash(), first) << "the hash sees a nanometre a second";
}

TEST(World, IslandsAreSolvedByThemselvesToTheBit) {
    // Two piles 100 m apart give the same bits as each alone.
    const sim::WorldDefinition one = pile(5, Fidelity::modal);
    sim::WorldDefinition two = one;
    two.planes.resize(1);
    sim::WorldDefinition alone = two;
    for (const sim::WorldBody& body : one.bodies) {
        two.bodies.push_back(body);
        two.bodies.back().world_from_body.translation().x() += 100;
    }
    sim::World both(two), first(alone);
    run(both, 400), run(first, 400);
    for (int i = 0; i < 5; ++i) EXPECT_TRUE(same(both.state(i), first.state(i))) << i;
}

TEST(World, ABrokenBodyIsQuarantinedAndTheOthersDoNotNotice) {
    for (const char* what : {"position", "velocity", "modal coordinates", "user force"}) {
        sim::WorldDefinition definition = pile(6, Fidelity::modal);
        sim::WorldDefinition with = definition;
        with.bodies.push_back(ball({0.2, 9, 0.1}, Fidelity::modal));
        sim::World without(definition), world(with);
        const double nan = std::numeric_limits<double>::quiet_NaN(),
                     infinity = std::numeric_limits<double>::infinity();
        // Up there it has touched nothing yet.
        run(world, 20), run(without, 20);
        sim::WorldBodyState state = world.state(6);
        if (what == std::string("position")) state.position.y() = nan;
        if (what == std::string("velocity")) state.velocity.x() = infinity;
        if (what == std::string("modal coordinates")) state.q[3] = nan;
        if (what == std::string("user force")) {
            world.apply_force(6, {nan, 0, 0}, {0, 0.5, 0});
        } else {
            world.set_state(6, state);
        }
        run(world, 300), run(without, 300);
        ASSERT_EQ(world.quarantined().size(), 1u) << what;
        EXPECT_EQ(world.quarantined()[0].body, 6);
        EXPECT_EQ(world.quarantined()[0].what, what);
        for (int i = 0; i < 6; ++i) EXPECT_TRUE(same(world.state(i), without.state(i))) << what << i;
    }
}

TEST(World, ABodyThatBreaksInContactLeavesItsNeighboursWhole) {
    for (const double rate : {std::numeric_limits<double>::infinity(), 1e200, 1e30}) {
        sim::WorldDefinition definition = on_floor();
        for (int i = 0; i < 3; ++i) definition.bodies.push_back(ball({0, 0.5 + i, 0}, Fidelity::modal));
        sim::PointConstraint link;
        link.name = "link";
        link.body_a = 1, link.point_a = {0.5, 0, 0};
        link.body_b = 2, link.point_b = {0.5, 0, 0};
        definition.constraints.push_back(link);
        sim::World world(definition);
        run(world, 60);
        sim::WorldBodyState state = world.state(1);
        state.q_dot[2] = rate;
        world.set_state(1, state);
        run(world, 120);
        ASSERT_EQ(world.quarantined().size(), 1u);
        EXPECT_EQ(world.quarantined()[0].what, "modal rates");
        EXPECT_FALSE(world.constraint_holds(0));
        for (int i = 0; i < 3; ++i)
            EXPECT_TRUE(world.state(i).position.allFinite() && world.state(i).q.allFinite());
    }
}

TEST(World, NothingFallsAsleepInMidAir) {
    sim::WorldDefinition slow = on_floor();
    slow.settings.gravity = {0, -0.01, 0};
    slow.bodies.push_back(ball({0, 3, 0}));
    sim::World falling(slow);
    run(falling, 120);
    EXPECT_FALSE(falling.asleep(0));
    sim::WorldDefinition drifting = weightless();
    drifting.bodies.push_back(ball({0, 3, 0}));
    drifting.bodies[0].velocity = {0.001, 0, 0};
    sim::World drift(drifting);
    run(drift, 600);
    EXPECT_NEAR(drift.state(0).position.x(), 0.01, 1e-12);
}

// What flies has not begun to come to rest, and what nothing holds does not stop by itself.
TEST(World, SlowBodiesThatNothingHoldsReboundAndDriftOn) {
    for (const double speed :
         {0.01, 0.015, 0.019}) {  // (slower ones are within reach of each other for half a second)
        sim::WorldDefinition meeting = weightless();
        for (const double side : {-1, 1}) {
            meeting.bodies.push_back(ball({side * (0.5 + speed), 3, 0}));  // they fly for a second
            meeting.bodies.back().velocity = {-side * speed, 0, 0};
            meeting.bodies.back().restitution = 1;
        }
        sim::World rebounding(meeting);
        run(rebounding, 240);
        for (const int i : {0, 1})
            EXPECT_NEAR(rebounding.state(i).velocity.x(), i == 0 ? -speed : speed, 0.01 * speed) << speed;
        sim::WorldDefinition together = meeting;
        for (const int i : {0, 1}) {
            together.bodies[i].world_from_body.translation().x() = i == 0 ? -0.5 : 0.5;
            together.bodies[i].velocity = {0, 0, speed};
        }
        sim::World drift(together);
        run(drift, 240);
        for (const int i : {0, 1}) EXPECT_NEAR(drift.state(i).velocity.z(), speed, 1e-6 * speed) << speed;
    }
}

TEST(World, DeformationDrivenToInversionIsHeldAtTheLimitWithoutGainOfEnergy) {
    for (const Fidelity fidelity : {Fidelity::linear, Fidelity::modal}) {
        sim::WorldDefinition definition = weightless();
        definition.settings.sleeping = false;
        definition.bodies.push_back(ball({0, 0, 0}, fidelity));
        definition.bodies[0].damping_ratio = 0;
        sim::World world(definition);
        const int modes = world.basis(0).count();
        // Coordinates far beyond det D = 0.
        for (int mode = 0; mode < modes; ++mode) {
            sim::WorldBodyState state = world.state(0);
            state.q.setZero(), state.q_dot.setZero();
            state.q[mode] = mode % 2 ? 1e3 : -1e3;
            state.q_dot[mode] = 1e5;
            world.set_state(0, state);
            double energy = world.energy().elastic + world.energy().kinetic;
            for (int k = 0; k < 60; ++k) {
                world.step();
                const sim::WorldBodyState now = world.state(0);
                ASSERT_TRUE(now.q.allFinite() && now.q_dot.allFinite());
                ASSERT_LE(world.energy().elastic + world.energy().kinetic, energy * (1 + 1e-9)) << mode;
                energy = world.energy().elastic + world.energy().kinetic;
                const Eigen::VectorXd nodal = world.basis(0).nodal * now.q;
                for (const Eigen::Vector3d& r : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.5, 0, 0),
                                                 Eigen::Vector3d(0.2, -0.3, 0.3)}) {
                    const Eigen::Matrix3d f =
                        Eigen::Matrix3d::Identity() + sim::displacement_at(world.basis(0), nodal, r).gradient;
                    ASSERT_GT(f.determinant(), 0.1) << "mode " << mode << " step " << k;
                }
            }
        }
        EXPECT_GT(world.counts().deformations_limited, 0u);
    }
}

TEST(World, SqueezedBetweenHugeForcesABodyStaysFiniteAndUninverted) {
    sim::WorldDefinition definition = weightless();
    definition.bodies.push_back(ball({0, 0, 0}, Fidelity::modal));
    sim::World world(definition);
    for (int k = 0; k < 300; ++k) {
        world.apply_force(0, {0, -1e7, 0}, {0, 0.5, 0});  // 20 000 times its weight
        world.apply_force(0, {0, 1e7, 0}, {0, -0.5, 0});
        world.step();
        const Eigen::VectorXd nodal = world.basis(0).nodal * world.state(0).q;
        const Eigen::Matrix3d f =
            Eigen::Matrix3d::Identity() + sim::displacement_at(world.basis(0), nodal, {0, 0.25, 0}).gradient;
        ASSERT_GT(f.determinant(), 0.1) << k;
        ASSERT_LT(world.state(0).velocity.norm(), 1e-6) << "the forces balance";
    }
    EXPECT_GT(world.counts().deformations_limited, 0u);
}

TEST(World, AtRestAwakeNothingDriftsAndNoMemoryIsTaken) {
    // 1e7 steps in the long run, of which the last million must not have moved anything either.
    sim::WorldDefinition definition = pile(2, Fidelity::modal);
    definition.settings.sleeping = false;
    definition.bodies.resize(1);
    definition.bodies[0].angular_velocity.setZero();
    sim::World world(definition);
    run(world, 5000);
    const sim::WorldBodyState start = world.state(0);
    const long pages = resident_pages();
    run(world, long_run() ? 10'000'000 : 100'000);
    const sim::WorldBodyState end = world.state(0);
    EXPECT_LT((end.position - start.position).norm(), 1e-6) << "m";
    EXPECT_LT(end.orientation.angularDistance(start.orientation), 1e-6) << "rad";
    EXPECT_LT((end.q - start.q).norm(), 1e-6);
    EXPECT_LT(end.velocity.norm(), 1e-6);
    EXPECT_LT(resident_pages(), pages + 64) << "a quarter of a megabyte for whatever else the process does";
}

TEST(World, APileFallsAsleepKeepsItsBitsAndWakesAsAWholeWhenItIsTouched) {
    sim::WorldDefinition definition = pile(6, Fidelity::linear);
    sim::World world(definition);
    for (int k = 0; k < 3000 && !world.all_asleep(); ++k) world.step();
    ASSERT_TRUE(world.all_asleep());
    const std::uint64_t hash = world.state_hash();
    run(world, long_run() ? 10'000'000 : 100'000);
    EXPECT_EQ(world.state_hash(), hash);
    EXPECT_EQ(world.counts().contacts, 0);
    sim::WorldBody visitor = ball({0, 6, 0}, Fidelity::linear);
    visitor.velocity = {0, -5, 0};
    world.add_body(visitor);
    int woken = 0;
    for (int k = 0; k < 120 && woken == 0; ++k) {
        world.step();
        for (int i = 0; i < 6; ++i) woken += !world.asleep(i);
    }
    EXPECT_GE(woken, 2) << "those that fell asleep together wake together";
}

TEST(World, AFreeModalBodyFliesItsParabolaTurnsFreelyAndRingsExactly) {
    sim::WorldDefinition definition;
    definition.bodies.push_back(ball({0, 0, 0}, Fidelity::modal));
    sim::WorldBody& body = definition.bodies[0];
    body.shape.base.semi_axes = {0.3, 0.4, 0.5};
    body.velocity = {1, 2, 3};
    body.angular_velocity = {0.1, 5, 0.1};
    sim::World world(definition);
    sim::WorldBodyState state = world.state(0);
    state.q.setConstant(1e-3);
    world.set_state(0, state);
    const Eigen::Vector3d turn = world.state(0).angular_momentum;
    run(world, 120);
    const Eigen::Vector3d expected =
        Eigen::Vector3d(1, 2, 3) * 2 + world.definition(0).gravity_scale * Eigen::Vector3d(0, -9.81, 0) * 2;
    EXPECT_LT((world.state(0).position - expected).norm(), 1e-11);
    EXPECT_EQ(world.state(0).angular_momentum, turn);
    const sim::ModalBasis& basis = world.basis(0);
    for (int k = 0; k < basis.count(); ++k) {
        const double omega = basis.omega[k], sigma = 0.05 * omega,
                     w = std::sqrt(omega * omega - sigma * sigma);
        const double z = 1e-3 * std::exp(-sigma * 2) * (std::cos(w * 2) + sigma / w * std::sin(w * 2));
        EXPECT_NEAR(world.state(0).q[k], z, 1e-14) << "mode " << k;
    }
}

TEST(World, AFallingBodyWithDragReachesItsTerminalSpeed) {
    sim::WorldDefinition definition;
    definition.bodies.push_back(ball({0, 0, 0}));
    definition.bodies[0].damping_alpha = 2;
    definition.bodies[0].angular_velocity = {1, 0, 0};
    sim::World world(definition);
    run(world, 60);
    const double fall = 9.81 / 2 * (1 - std::exp(-2.0));
    EXPECT_NEAR(world.state(0).velocity.y(), -fall, 1e-12);
    EXPECT_NEAR(world.state(0).position.y(), -(9.81 / 2 * 1 - fall / 2), 1e-12);
    EXPECT_NEAR(world.state(0).angular_momentum.norm(), world.rigid_mass(0).inertia.x() * std::exp(-2.0),
                1e-12);
}

TEST(HeldStep, IsTheOscillatorUnderAConstantForceForAnyStepAndDamping) {
    // Against many small exact steps of the free oscillator about the displaced equilibrium f / omega^2.
    for (const double turn : {1e-6, 1e-3, 0.1, 1.0, 3.0, 30.0, 1e3})
        for (const double ratio : {0.0, 0.05, 0.9999, 1.0, 3.0}) {
            const double omega = 50, tau = turn / omega, sigma = ratio * omega, z0 = 0.3, v0 = -2, p = 0.7;
            const sim::HeldStep step = sim::held_step(omega, sigma, tau);
            const double mean = step.mean_z * z0 + step.mean_rate * v0 + step.compliance * p;
            const double rate = step.c * z0 + step.d * v0 + step.rate * p;
            const double rest = p / tau / (omega * omega);
            double z = z0 - rest, v = v0;
            sim::advance(sim::oscillator_step(omega, sigma, tau), z, v);
            // 1 - a loses what a is close to 1, which 1 / tau then makes larger.
            EXPECT_NEAR(z0 + tau * mean, z + rest, 1e-9 * (1 + rest)) << turn << " " << ratio;
            EXPECT_NEAR(rate, v, 1e-9 * (std::abs(v0) + omega * z0 + omega * rest)) << turn << " " << ratio;
            EXPECT_GE(step.compliance, 0) << "a force never makes a mode give way against it";
            EXPECT_LE(step.compliance, 0.5 + 1e-9);
        }
}

TEST(World, RefusesWhatMakesNoSenseByName) {
    auto refusal = [](sim::WorldDefinition definition) -> std::string {
        try {
            sim::World world(definition);
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return "accepted";
    };
    sim::WorldDefinition good = pile(2, Fidelity::rigid);
    EXPECT_EQ(refusal(good), "accepted");
    sim::WorldDefinition bad = good;
    bad.bodies[1].material.poisson = 0.5;
    EXPECT_EQ(refusal(bad), "body 'ball': Poisson's ratio: found 0.5, expected -0.9 to 0.495");
    bad = good;
    bad.settings.dt = 0;
    EXPECT_NE(refusal(bad).find("dt [s]: found 0"), std::string::npos);
    bad = good;
    bad.bodies[0].world_from_body.translation().x() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_NE(refusal(bad).find("position"), std::string::npos);
    bad = good;
    bad.constraints.push_back({});
    bad.constraints[0].body_a = 7;
    EXPECT_NE(refusal(bad).find("first body: found 7, expected 0 to 1"), std::string::npos);
    bad = good;
    bad.planes[0].normal = {0, 2, 0};
    EXPECT_NE(refusal(bad).find("normal"), std::string::npos);
}
