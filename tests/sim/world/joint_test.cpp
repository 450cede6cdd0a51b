#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <random>

#include "world_bodies.h"

// Hinges and sliders against closed forms and conservation laws, over size, step, stiffness and fidelity.

using namespace world_test;
using sim::Fidelity;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const Eigen::Vector3d kX = Eigen::Vector3d::UnitX(), kY = Eigen::Vector3d::UnitY(),
                      kZ = Eigen::Vector3d::UnitZ();

/// A joint of a, at rest in the pose in which both bodies are, whose axis is `axis` in the world; b -1: to the world.
sim::PointConstraint joint(sim::Joint type, const sim::WorldDefinition& world, int a, int b,
                           const Eigen::Vector3d& at, const Eigen::Vector3d& axis,
                           double stiffness = kInfinity) {
    sim::PointConstraint c;
    c.name = "joint", c.joint = type, c.stiffness = stiffness;
    auto pose = [&world](int body) {
        return body < 0 ? Eigen::Isometry3d::Identity()
                        : world.bodies[static_cast<std::size_t>(body)].world_from_body;
    };
    const Eigen::Quaterniond frame = Eigen::Quaterniond::FromTwoVectors(kX, axis);
    c.body_a = a, c.body_b = b;
    c.point_a = pose(a).inverse() * at, c.point_b = pose(b).inverse() * at;
    c.frame_a = Eigen::Quaterniond(pose(a).rotation()).conjugate() * frame;
    c.frame_b = Eigen::Quaterniond(pose(b).rotation()).conjugate() * frame;
    return c;
}

/// A bar of half lengths size (0.5, 0.05, 0.1) that hangs from an axis along z through its end, turned by `angle`.
sim::WorldDefinition pendulum(double size, double angle, double dt, double stiffness, Fidelity fidelity) {
    sim::WorldDefinition world;
    world.settings.dt = dt, world.settings.sleeping = false;
    sim::WorldBody bar = box({0, 0, 0}, size * Eigen::Vector3d(0.5, 0.05, 0.1), 1000);
    bar.fidelity.fidelity = fidelity, bar.material.young_pa = 1e10;
    bar.damping_ratio = 0;
    const Eigen::AngleAxisd turn(angle - std::numbers::pi / 2, kZ);
    bar.world_from_body.linear() = turn.toRotationMatrix();
    bar.world_from_body.translation() = turn * (0.5 * size * kX);
    world.bodies.push_back(bar);
    world.constraints.push_back(joint(sim::Joint::hinge, world, 0, -1, {0, 0, 0}, kZ, stiffness));
    return world;
}

double angle_of(const sim::World& world) {
    const Eigen::Vector3d x = world.state(0).orientation * kX;
    return std::atan2(x.x(), -x.y());
}

/// From energy at first, of what moves most [J].
double most_gained(sim::World& world, int steps) {
    const double first = world.energy().total();
    double most = 0;
    for (int k = 0; k < steps; ++k) {
        world.step();
        most = std::max(most, world.energy().total() - first);
    }
    return most;
}

}  // namespace

// T = 4 sqrt(I / (m g d)) K(sin(angle / 2)). Of second order in a substep, in which the bar turns by at most 0.04 rad; and
// the time at which it hangs straight is interpolated, by a cubic of what a step turns.
TEST(HingesAndSliders, APhysicalPendulumSwingsWithItsPeriod) {
    for (const double size : {0.01, 1., 10.})
        for (const double dt : {1 / 30., 1 / 120., 1 / 480.})
            for (const double angle : {0.1, 1.5, 2.8}) {
                sim::World world(pendulum(size, angle, dt, kInfinity, Fidelity::rigid));
                const sim::RigidMass mass = world.rigid_mass(0);
                const double d = size / 2, inertia = mass.inertia.z() + mass.mass * d * d;
                const double rate = std::sqrt(mass.mass * 9.81 * d / inertia),
                             fastest = 2 * rate * std::sin(angle / 2);
                if (fastest * dt > 0.5 || rate * dt > 0.3) continue;
                const double expected = 4 / rate * std::comp_ellint_1(std::sin(angle / 2));
                double before = angle, first = -1, last = -1;
                for (int crossings = 0; crossings < 5 && world.time_s() < 4 * expected;) {
                    world.step();
                    const double now = angle_of(world);
                    if (std::abs(now) < 1 && (now < 0) != (before < 0)) {
                        last = world.time_s() - dt * now / (now - before);
                        if (crossings++ == 0) first = last;
                    }
                    before = now;
                }
                EXPECT_NEAR((last - first) / 2 / expected, 1, 1e-3) << size << ' ' << dt << ' ' << angle;
            }
}

TEST(HingesAndSliders, APendulumOfAnyStiffnessStepAndFidelityGainsNoEnergyAndKeepsItsAxis) {
    for (const double size : {0.01, 1., 10.})
        for (const double dt : {1 / 30., 1 / 480.})
            for (const double stiffness : {1e3, 1e6, 1e9, kInfinity})
                for (const Fidelity fidelity : {Fidelity::rigid, Fidelity::linear, Fidelity::modal}) {
                    if (fidelity == Fidelity::modal && dt < 1 / 100.) continue;
                    sim::World world(pendulum(size, 1.5, dt, stiffness, fidelity));
                    const sim::RigidMass mass = world.rigid_mass(0);
                    const double gained = most_gained(world, static_cast<int>(4 / dt));
                    EXPECT_LT(gained / (mass.mass * 9.81 * size / 2), 1e-3)
                        << size << ' ' << dt << ' ' << stiffness << ' ' << int(fidelity);
                    if (stiffness < kInfinity) continue;
                    const Eigen::Vector3d axis = world.state(0).orientation * kZ;
                    EXPECT_LT(axis.cross(kZ).norm(), 1e-6) << size << ' ' << dt << ' ' << int(fidelity);
                }
}

// Out of balance: the axis is none of the body's own, so the hinge holds against a load that turns with the body. Without
// gravity nothing has a moment about the axis: the spin stays.
TEST(HingesAndSliders, AHingeHoldsAnUnbalancedRotorWithoutBrakingIt) {
    for (const double size : {0.01, 1., 10.})
        for (const double spin : {3., 60.})
            for (const double dt : {1 / 30., 1 / 240.}) {
                sim::WorldDefinition world = weightless();
                world.settings.dt = dt, world.settings.sleeping = false;
                sim::WorldBody rotor = box({0, 0, 0}, size * Eigen::Vector3d(0.5, 0.1, 0.2), 1000);
                const Eigen::Vector3d axis = Eigen::Vector3d(1, 1, 0.5).normalized();
                rotor.angular_velocity = spin * axis;
                world.bodies.push_back(rotor);
                world.constraints.push_back(joint(sim::Joint::hinge, world, 0, -1, {0, 0, 0}, axis));
                sim::World w(world);
                const Eigen::Vector3d own = axis;  // the body's frame is the world's at first
                const double energy = w.energy().kinetic;
                for (int k = 0; k * dt < 2; ++k) w.step();
                EXPECT_NEAR(w.energy().kinetic / energy, 1, 1e-3) << size << ' ' << spin << ' ' << dt;
                EXPECT_LT((w.state(0).orientation * own).cross(axis).norm(), 1e-6)
                    << size << ' ' << spin << ' ' << dt;
                EXPECT_LT(w.state(0).position.norm(), 1e-6 * size) << size << ' ' << spin << ' ' << dt;
            }
}

// Two free bodies: momentum and angular momentum to rounding of the rows (floats, 1e-7), energy bounded.
TEST(HingesAndSliders, TwoHingedBodiesKeepMomentumAndEnergy) {
    for (const sim::Joint type : {sim::Joint::hinge, sim::Joint::slider})
        for (const double dt : {1 / 30., 1 / 240.})
            for (const double stiffness : {1e5, kInfinity}) {
                sim::WorldDefinition world = weightless();
                world.settings.dt = dt, world.settings.sleeping = false;
                world.bodies.push_back(box({-0.5, 0, 0}, {0.5, 0.1, 0.2}, 1000));
                world.bodies.push_back(box({0.5, 0.1, 0}, {0.5, 0.1, 0.1}, 2000));
                world.bodies[0].angular_velocity = {0.5, 2, 3};
                world.bodies[0].velocity = {0, 1, 0};
                world.bodies[1].velocity = {0, 0, 0.5};
                world.constraints.push_back(
                    joint(type, world, 0, 1, {0, 0, 0}, Eigen::Vector3d(0.2, 0, 1).normalized(), stiffness));
                world.constraints[0].collide = false;  // they touch, and would rub
                sim::World w(world);
                const Eigen::Vector3d p = w.momentum(), l = w.angular_momentum();
                w.step();  // what the joint does not allow is taken from the velocities at once
                const double energy = w.energy().total();
                double most = 0, least = energy;
                for (int k = 0; k * dt < 10; ++k) {
                    w.step();
                    most = std::max(most, w.energy().total()), least = std::min(least, w.energy().total());
                }
                EXPECT_LT((w.momentum() - p).norm(), 1e-6 * p.norm());
                EXPECT_LT((w.angular_momentum() - l).norm(), 1e-5 * l.norm())
                    << int(type) << ' ' << dt << ' ' << stiffness;
                EXPECT_LT(most / energy, 1.001) << int(type) << ' ' << dt << ' ' << stiffness;
                if (stiffness == kInfinity) {
                    EXPECT_GT(least / energy, 0.999) << int(type) << ' ' << dt;
                }
            }
}

// x = g sin(a) t^2 / 2, which the scheme keeps to rounding.
TEST(HingesAndSliders, ASliderOnAnInclineAcceleratesByGSinA) {
    for (const double size : {0.01, 1., 10.})
        for (const double dt : {1 / 30., 1 / 480.})
            for (const Fidelity fidelity : {Fidelity::rigid, Fidelity::linear}) {
                const double a = 0.4;
                sim::WorldDefinition world;
                world.settings.dt = dt, world.settings.sleeping = false;
                world.bodies.push_back(box({0, 0, 0}, size * Eigen::Vector3d(0.3, 0.1, 0.2), 1000));
                world.bodies[0].fidelity.fidelity = fidelity, world.bodies[0].material.young_pa = 1e11;
                const Eigen::Vector3d axis(std::cos(a), -std::sin(a), 0);
                world.constraints.push_back(
                    joint(sim::Joint::slider, world, 0, -1, size * Eigen::Vector3d(0.1, 0.1, 0.1), axis));
                sim::World w(world);
                run(w, static_cast<int>(std::lround(1 / dt)));
                const Eigen::Vector3d place = w.state(0).position;
                const double expected = 9.81 * std::sin(a) / 2;
                EXPECT_NEAR(place.dot(axis) / expected, 1, 1e-5) << size << ' ' << dt << ' ' << int(fidelity);
                EXPECT_LT(place.cross(axis).norm(), 1e-5 * size) << size << ' ' << dt << ' ' << int(fidelity);
                EXPECT_LT(w.state(0).orientation.vec().norm(), 1e-5)
                    << size << ' ' << dt << ' ' << int(fidelity);
            }
}

// A second hinge on the same axis says what the first does: the redundant rows must not spoil it.
TEST(HingesAndSliders, ADoorHangsOnTwoHinges) {
    for (const double stiffness : {1e6, kInfinity}) {
        sim::WorldDefinition world;
        world.settings.sleeping = false;
        world.bodies.push_back(box({0.5, 1, 0}, {0.5, 1, 0.02}, 600));
        world.bodies[0].angular_velocity = {0, 2, 0};
        world.bodies[0].velocity = {0, 0, -1};
        for (const double height : {0.3, 1.7})
            world.constraints.push_back(
                joint(sim::Joint::hinge, world, 0, -1, {0, height, 0}, kY, stiffness));
        sim::World w(world);
        const double energy = w.energy().kinetic;
        run(w, 300);
        const Eigen::Vector3d axis = w.state(0).orientation * kY;
        EXPECT_LT(axis.cross(kY).norm(), stiffness < kInfinity ? 1e-3 : 1e-6);
        EXPECT_NEAR(w.energy().kinetic / energy, 1, 1e-3) << stiffness;
        const double turned =
            std::atan2(-(w.state(0).orientation * kX).z(), (w.state(0).orientation * kX).x());
        EXPECT_NEAR(std::remainder(turned - 2 * 5, 2 * std::numbers::pi), 0, 1e-3) << stiffness;
    }
}

TEST(HingesAndSliders, JoinedBodiesCollideUnlessTheirJointLiesWithinBoth) {
    // Two cubes side by side, 0.2 m apart, turned against each other about z by a joint.
    auto overlap = [](double at, std::optional<bool> collide) {
        sim::WorldDefinition world = weightless();
        world.settings.sleeping = false;
        world.bodies.push_back(box({-0.6, 0, 0}, {0.5, 0.5, 0.5}, 100));
        world.bodies.push_back(box({0.6, 0, 0}, {0.5, 0.5, 0.5}, 100));
        world.bodies[0].fixed = true;
        world.bodies[1].angular_velocity = {0, 0, 2};
        world.bodies[1].velocity = {0, 1.2 - 2 * at, 0};
        sim::PointConstraint c = joint(sim::Joint::hinge, world, 1, 0, {at, 0, 0}, kZ);
        c.collide = collide;
        world.constraints.push_back(c);
        sim::World w(world);
        int contacts = 0;
        for (int k = 0; k < 60; ++k) {
            w.step();
            contacts += w.counts().contacts;
        }
        return contacts;
    };
    EXPECT_GT(overlap(0, {}), 0);  // between them
    EXPECT_EQ(overlap(0, false), 0);
    sim::WorldDefinition world = weightless();
    world.bodies.push_back(box({-0.4, 0, 0}, {0.5, 0.5, 0.5}, 100));
    world.bodies.push_back(box({0.4, 0, 0}, {0.5, 0.5, 0.5}, 100));
    world.constraints.push_back(joint(sim::Joint::ball, world, 1, 0, {0, 0, 0}, kX));
    for (const auto& [collide, any] : {std::pair(std::optional<bool>(), false), {true, true}}) {
        world.constraints[0].collide = collide;
        sim::World w(world);
        w.step();
        EXPECT_EQ(w.counts().contacts > 0, any);
    }
}

namespace {

/// A tree of two to six rigid bodies, the first held by the world, joined by hinges, sliders (with a soft spring) and balls of one
/// random stiffness along random axes; random sizes (1 cm to 10 m), shapes, spins and step. They do not collide.
sim::WorldDefinition mechanism(std::uint64_t seed, std::string& what) {
    std::mt19937_64 random(seed);
    auto below = [&random](int n) { return static_cast<int>(random() % static_cast<std::uint64_t>(n)); };
    auto uniform = [&random](double low, double high) {
        return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    auto any = [&] { return Eigen::Vector3d(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)); };
    sim::WorldDefinition world;
    const double size = std::pow(10., uniform(-2, 1)), rate = std::sqrt(9.81 / size);
    const double steps[] = {1 / 30., 1 / 60., 1 / 120., 1 / 480.};
    world.settings.dt = steps[below(4)], world.settings.sleeping = false;
    const int count = 2 + below(5);
    const double density = 1000, mass = density * size * size * size / 10;
    // From a tenth of the bodies' own frequency to a thousand times the step's; or rigid.
    const double stiffness = below(3) == 0 ? kInfinity : std::pow(10., uniform(1, 9)) * mass * rate * rate;
    what = "seed " + std::to_string(seed) + ": size " + std::to_string(size) + ", 1/" +
           std::to_string(1 / world.settings.dt) + " s, " + std::to_string(stiffness) + " N/m, joints";
    for (int i = 0; i < count; ++i) {
        const Eigen::Vector3d half =
            size * Eigen::Vector3d(uniform(0.2, 0.5), uniform(0.1, 0.3), uniform(0.1, 0.3));
        sim::WorldBody body =
            below(2) == 0 ? box(Eigen::Vector3d::Zero(), half, density) : ball(Eigen::Vector3d::Zero());
        if (body.name == "ball") body.shape.base.semi_axes = half, body.material.density_kg_m3 = density;
        body.name += std::to_string(i);
        const int to = i == 0 ? -1 : below(i);
        const Eigen::Vector3d beside =
            to < 0
                ? Eigen::Vector3d(0, 0, 0)
                : Eigen::Vector3d(world.bodies[static_cast<std::size_t>(to)].world_from_body.translation());
        body.world_from_body.translation() = beside + 0.6 * size * any();
        body.world_from_body.linear() =
            Eigen::Quaterniond(Eigen::AngleAxisd(uniform(0, 3), any().normalized())).toRotationMatrix();
        body.angular_velocity = 2 * rate * any();
        world.bodies.push_back(body);
        const sim::Joint type = static_cast<sim::Joint>(below(3));
        what += ' ' + std::to_string(static_cast<int>(type));
        world.constraints.push_back(joint(type, world, i, to,
                                          (beside + body.world_from_body.translation()) / 2,
                                          any().normalized(), stiffness));
        world.constraints.back().name += std::to_string(i);
        world.constraints.back().collide = false;
        if (type != sim::Joint::slider) continue;
        sim::PointConstraint spring = world.constraints.back();  // that draws it back
        spring.name += " spring", spring.joint = sim::Joint::ball, spring.stiffness = mass * rate * rate;
        world.constraints.push_back(spring);
    }
    // Nor do those that no joint joins: threads of no stiffness to speak of keep them from it.
    for (int i = 0; i < count; ++i)
        for (int k = 0; k < i; ++k) {
            sim::PointConstraint thread;
            thread.name = "thread", thread.body_a = i, thread.body_b = k, thread.stiffness = 1e-9,
            thread.collide = false;
            world.constraints.push_back(thread);
        }
    return world;
}

/// The most energy gained over 10 s [of what moved most, or fell by the size], after the first step, which takes what the
/// joints do not allow out of the speeds.
double gained_share(sim::World& world, double dt, double size) {
    world.step();
    const double first = world.energy().total();
    double mass = 0, most = 0, moved = 0;
    for (int i = 0; i < world.bodies(); ++i) mass += world.rigid_mass(i).mass;
    for (int k = 0; k * dt < 10; ++k) {
        world.step();
        const sim::World::Energy e = world.energy();
        most = std::max(most, e.total() - first), moved = std::max(moved, e.kinetic);
    }
    return most / (moved + mass * 9.81 * size);
}

void expect_no_gain(std::uint64_t first, std::uint64_t last) {
    double worst = 0;
    for (std::uint64_t seed = first; seed <= last; ++seed) {
        std::string what;
        const sim::WorldDefinition definition = mechanism(seed, what);
        double size = 0;
        for (const sim::WorldBody& body : definition.bodies)
            size = std::max(size, body.shape.base.semi_axes.maxCoeff());
        sim::World world(definition);
        const double gained = gained_share(world, definition.settings.dt, size);
        EXPECT_LT(gained, 1e-3) << what;
        EXPECT_TRUE(world.quarantined().empty()) << what;
        worst = std::max(worst, gained);
    }
    std::printf("most gained: %.2e\n", worst);
}

}  // namespace

TEST(HingesAndSliders, RandomMechanismsGainNoEnergyIn10Seconds) {
    expect_no_gain(1, 24);
}
