#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "world_bodies.h"

// Ordinary scenes that break solvers, swept over size, step and stiffness: stacks stand, joints give no energy.

using namespace world_test;
using sim::Fidelity;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The total energy over its first value, at most, as a share of `scale` [J].
double most_gained(sim::World& world, double seconds, double dt, double scale) {
    const double first = world.energy().total();
    double most = 0;
    for (int k = 0; k * dt < seconds; ++k) {
        world.step();
        most = std::max(most, world.energy().total() - first);
    }
    return most / scale;
}

sim::PointConstraint joint(int a, const Eigen::Vector3d& point_a, int b, const Eigen::Vector3d& point_b,
                           double stiffness) {
    sim::PointConstraint c;
    c.name = "joint";
    c.body_a = a, c.point_a = point_a;
    c.body_b = b, c.point_b = point_b;
    c.stiffness = stiffness;
    return c;
}

/// Balls in a level row, each tied to the next, the first to a place; `size` between their middles.
sim::WorldDefinition row_of_balls(int count, double size, double stiffness) {
    sim::WorldDefinition definition;
    definition.settings.sleeping = false;
    for (int i = 0; i < count; ++i) {
        definition.bodies.push_back(ball({(i + 0.5) * size, 0, 0}, Fidelity::rigid, 0.4 * size, 1000));
        definition.constraints.push_back(
            i == 0 ? joint(0, {-size / 2, 0, 0}, -1, {0, 0, 0}, stiffness)
                   : joint(i - 1, {size / 2, 0, 0}, i, {-size / 2, 0, 0}, stiffness));
    }
    return definition;
}

sim::WorldDefinition stack(int count, double size, double on_top = 1) {
    sim::WorldDefinition definition = on_floor();
    for (int i = 0; i < count; ++i) {
        definition.bodies.push_back(box({0, (i + 0.5) * size, 0}, Eigen::Vector3d::Constant(size / 2), 1000));
        if (i + 1 == count) definition.bodies.back().material.density_kg_m3 *= on_top;
    }
    return definition;
}

/// The furthest that a body is from where it was put, in sizes.
double drift(const sim::World& world, const sim::WorldDefinition& definition, double size) {
    double most = 0;
    for (int i = 0; i < static_cast<int>(definition.bodies.size()); ++i)
        most = std::max(most, (world.state(i).position -
                               definition.bodies[static_cast<std::size_t>(i)].world_from_body.translation())
                                      .norm() /
                                  size);
    return most;
}

}  // namespace

TEST(Joints, GiveNoEnergyAtAnySizeStepOrStiffness) {
    for (const double size : {0.01, 0.1, 1.0, 10.0})
        for (const double dt : {1.0 / 30, 1.0 / 60, 1.0 / 480})
            for (const double stiffness : {1e3, 1e6, 1e9, kInfinity})
                for (const int count : {1, 2, 5}) {
                    sim::WorldDefinition definition = row_of_balls(count, size, stiffness);
                    definition.settings.dt = dt;
                    sim::World world(definition);
                    double fall = 0;  // of the whole row to the vertical [J]
                    for (int i = 0; i < count; ++i)
                        fall += world.rigid_mass(i).mass * 9.81 * (i + 0.5) * size;
                    // A soft spring's energy is the trapezoidal rule's, which swings by (omega h)^2 / 16 of it.
                    EXPECT_LT(most_gained(world, 3, dt, fall), 1e-3)
                        << size << " m, " << dt << " s, " << stiffness << " N/m, " << count << " balls";
                    EXPECT_TRUE(world.quarantined().empty()) << size << ' ' << dt << ' ' << stiffness;
                }
}

TEST(Joints, ATopKeepsItsEnergyFor10Seconds) {
    for (const double size : {0.01, 0.1, 1.0})
        for (const double dt : {1.0 / 30, 1.0 / 60, 1.0 / 240}) {
            sim::WorldDefinition definition;
            definition.settings.sleeping = false;
            definition.settings.dt = dt;
            definition.bodies.push_back(
                ball({size * std::sin(0.4), size * std::cos(0.4), 0}, Fidelity::rigid, 0.5 * size, 1000));
            definition.bodies[0].shape.base.semi_axes = {0.5 * size, 0.15 * size, 0.5 * size};
            definition.bodies[0].world_from_body.linear() =
                Eigen::AngleAxisd(-0.4, Eigen::Vector3d::UnitZ()).toRotationMatrix();
            definition.bodies[0].angular_velocity =
                60 * Eigen::Vector3d(std::sin(0.4), std::cos(0.4), 0);  // about its own axis
            definition.constraints.push_back(joint(0, {0, -size, 0}, -1, {0, 0, 0}, kInfinity));
            sim::World world(definition);
            const double spin = world.energy().kinetic;
            EXPECT_LT(most_gained(world, 10, dt, spin), 1e-3) << size << " m, " << dt << " s";
        }
}

TEST(Joints, AChainOf20CarriesAThousandfoldWeightAndStretchesUnder1Percent) {
    for (const double size : {0.01, 0.1, 1.0}) {
        sim::WorldDefinition definition = row_of_balls(20, size, kInfinity);
        for (int i = 0; i < 20; ++i) {  // hanging
            definition.bodies[static_cast<std::size_t>(i)].world_from_body.translation() =
                Eigen::Vector3d(0, -(i + 0.5) * size, 0);
            sim::PointConstraint& c = definition.constraints[static_cast<std::size_t>(i)];
            for (Eigen::Vector3d* point : {&c.point_a, &c.point_b}) *point = {0, -point->x(), 0};
        }
        definition.bodies.back().material.density_kg_m3 *= 1000;
        sim::World world(definition);
        run(world, 1200);
        EXPECT_NEAR(world.state(19).position.y() / (-19.5 * size), 1, 0.01) << size;
        EXPECT_LT(world.energy().kinetic, 1e-6 * world.rigid_mass(19).mass * 9.81 * size);
    }
}

TEST(Stacks, Of30CubesStandForAMinute) {
    for (const double size : {0.01, 0.1, 1.0}) {
        const sim::WorldDefinition definition = stack(30, size);
        sim::World world(definition);
        run(world, 3600);
        EXPECT_LT(drift(world, definition, size), 0.01) << size << " m";
    }
}

TEST(Stacks, StandAtEveryStepAlsoAwake) {
    for (const double dt : {1.0 / 30, 1.0 / 90, 1.0 / 480})
        for (const double size : {0.013, 0.7, 10.0}) {
            sim::WorldDefinition definition = stack(8, size);
            definition.settings.dt = dt;
            definition.settings.sleeping = false;
            sim::World world(definition);
            for (int k = 0; k * dt < 5; ++k) world.step();
            EXPECT_LT(drift(world, definition, size), 0.01) << dt << " s, " << size << " m";
        }
}

TEST(Stacks, ALightBodyCarriesAThousandfoldOne) {
    for (const double size : {0.01, 0.1, 1.0}) {
        const sim::WorldDefinition definition = stack(2, size, 1000);
        sim::World world(definition);
        run(world, 3600);
        EXPECT_LT(drift(world, definition, size), 0.05)
            << size << " m: the overlap is under 10 % of the size";
    }
}

TEST(Stacks, Of20PlatesStand) {
    for (const double size : {0.1, 1.0}) {
        sim::WorldDefinition definition = on_floor();
        for (int i = 0; i < 20; ++i)
            definition.bodies.push_back(
                box({0, (i + 0.5) * 0.1 * size, 0}, Eigen::Vector3d(0.5, 0.05, 0.5) * size, 1000));
        sim::World world(definition);
        run(world, 3600);
        EXPECT_LT(drift(world, definition, 0.1 * size), 0.05) << size << " m";
    }
}
