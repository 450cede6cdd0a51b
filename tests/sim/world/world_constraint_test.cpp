#include <gtest/gtest.h>

#include <cmath>

#include "world_bodies.h"

using namespace world_test;
using sim::Fidelity;

namespace {

constexpr double kG = 9.81;

sim::PointConstraint to_place(int body, const Eigen::Vector3d& point, const Eigen::Vector3d& place,
                              double k) {
    sim::PointConstraint c;
    c.name = "c";
    c.body_a = body;
    c.point_a = point;
    c.point_b = place;
    c.stiffness = k;
    return c;
}

Eigen::Vector3d momentum_of(const sim::World& world) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int i = 0; i < world.bodies(); ++i) sum += world.rigid_mass(i).mass * world.state(i).velocity;
    return sum;
}

}  // namespace

TEST(WorldConstraint, AHangingBodyStretchesItsSpringByItsWeight) {
    for (const Fidelity fidelity : {Fidelity::rigid, Fidelity::linear, Fidelity::modal}) {
        for (const double k : {1e3, 1e5, 1e9}) {
            sim::WorldDefinition definition;
            definition.settings.sleeping = false;
            definition.bodies.push_back(ball({0, 0, 0}, fidelity));
            definition.constraints.push_back(to_place(0, {0, 0.5, 0}, {0, 0.5, 0}, k));
            sim::World world(definition);
            run(world, 3000);
            const double mass = world.rigid_mass(0).mass;
            const sim::WorldBodyState s = world.state(0);
            const Eigen::VectorXd nodal = world.basis(0).nodal * s.q;
            const Eigen::Vector3d u = fidelity == Fidelity::rigid
                                          ? Eigen::Vector3d::Zero()
                                          : sim::displacement_at(world.basis(0), nodal, {0, 0.5, 0}).value;
            const double hung = 0.5 - (s.position + s.orientation * (Eigen::Vector3d(0, 0.5, 0) + u)).y();
            EXPECT_NEAR(hung, mass * kG / k, 1e-3 * mass * kG / k + 1e-6) << "k " << k;
            if (fidelity == Fidelity::modal) {
                EXPECT_GT(u.y(), 1e-5) << "it is drawn out by its own weight";
                double compliance = 0;  // of the modes at the point, along y
                const Eigen::Matrix3Xd phi = sim::mode_shapes_at(world.basis(0), {0, 0.5, 0});
                for (int m = 0; m < world.basis(0).count(); ++m)
                    compliance += std::pow(phi(1, m) / world.basis(0).omega[m], 2);
                EXPECT_NEAR(u.y() / (compliance * mass * kG), 1, 0.02);
            }
        }
    }
}

// A body with modes that slides on a floor without friction: its contact is swept, and the spring is a force in the sweeps.
// Closed form: cos(omega t); velocity Verlet is ahead by omega^2 h^2 / 24 of it (Hairer, Lubich, Wanner 2006, I.1.4).
TEST(WorldConstraint, ASoftSpringOfASlidingBodyKeepsItsPeriodAndEnergy) {
    for (const double k : {2e3, 2e4, 1.5e5}) {
        SCOPED_TRACE(k);
        sim::WorldDefinition definition = on_floor();
        definition.planes[0].friction = 0;
        sim::WorldBody body = ball({0.3, 0.5, 0}, Fidelity::modal);
        body.material.young_pa = 1e9;
        body.friction = 0;
        definition.bodies.push_back(body);
        definition.constraints.push_back(to_place(0, {0, 0, 0}, {0, 0.5, 0}, k));
        definition.constraints[0].damping_ratio = 0;
        sim::World world(definition);
        const double mass = world.rigid_mass(0).mass, omega = std::sqrt(k / mass),
                     h = definition.settings.dt / definition.settings.substeps,
                     ahead = 1 + std::pow(omega * h, 2) / 24;
        double furthest = 0, largest = 0;
        const int steps = 240;
        for (int i = 0; i < steps; ++i) {
            world.step();
            const double x = world.state(0).position.x();
            furthest = std::max(furthest, std::abs(x - 0.3 * std::cos(omega * ahead * world.time_s())));
            if (i > 3 * steps / 4) largest = std::max(largest, std::abs(x));
        }
        EXPECT_LT(furthest, 0.02 * 0.3);
        EXPECT_GT(largest, 0.98 * 0.3 * std::cos(omega * definition.settings.dt / 2))
            << "between steps it is further out";
    }
}

// Contacts of much heavier bodies are solved directly after the sweeps, whose energy counts a spring otherwise: neither may take
// the other's for a gain. A ball with modes on a heavy block, between them a spring along the block's top, both without friction.
TEST(WorldConstraint, ASoftSpringToAMuchHeavierBodyKeepsSwingingAndTakesNoCommonSpeed) {
    for (const double ratio : {20.0, 28.0, 31.0, 60.0}) {
        SCOPED_TRACE(ratio);
        sim::WorldDefinition definition = on_floor();
        definition.planes[0].friction = 0;
        sim::WorldBody block = box({0, 0.5, 0}, {3, 0.5, 0.5}),
                       rider = ball({1, 1.25, 0}, Fidelity::modal, 0.25);
        block.friction = rider.friction = 0;
        rider.material.young_pa = 1e8;
        definition.bodies = {block, rider};
        const double ball_mass = sim::World(definition).rigid_mass(1).mass,
                     block_mass = sim::World(definition).rigid_mass(0).mass;
        definition.bodies[0].material.density_kg_m3 *= ratio * ball_mass / block_mass;
        for (sim::WorldBody& body : definition.bodies) body.velocity = {1, 0, 0};
        sim::PointConstraint tie = to_place(1, {0, 0, 0}, {0.9, 0.75, 0}, 7540 * ball_mass / 6.5);
        tie.body_b = 0, tie.damping_ratio = 0, tie.collide = true;
        definition.constraints = {tie};
        sim::World world(definition);
        double first = 0, last = 0;
        for (int i = 0; i < 240; ++i) {
            world.step();
            const double stretch = std::abs(world.state(1).position.x() - world.state(0).position.x() - 0.9);
            if (i < 30) first = std::max(first, stretch);
            if (i >= 210) last = std::max(last, stretch);
        }
        EXPECT_GT(first, 0.09);
        // The swing turns the ball's weight over, too; where it was lost, 0.1 of it was left.
        EXPECT_GT(last, 0.6 * first);
        EXPECT_LT(last, 1.02 * first);
        const double common =
            (ratio * world.state(0).velocity.x() + world.state(1).velocity.x()) / (1 + ratio);
        EXPECT_NEAR(common, 1, 1e-3);
    }
}

TEST(WorldConstraint, ConflictingConstraintsMeetInTheMiddleByTheirStiffness) {
    sim::WorldDefinition definition = weightless();
    definition.settings.sleeping = false;
    definition.bodies.push_back(ball({0.3, 0, 0}));
    definition.constraints.push_back(to_place(0, {0, 0, 0}, {-1, 0, 0}, 1e6));
    definition.constraints.push_back(to_place(0, {0, 0, 0}, {2, 0, 0}, 3e6));
    sim::World world(definition);
    for (int k = 0; k < 2000; ++k) {
        world.step();
        ASSERT_LT(world.state(0).position.norm(), 2.1) << "bounded";
    }
    EXPECT_NEAR(world.state(0).position.x(), (-1.0 * 1e6 + 2.0 * 3e6) / 4e6, 1e-6);
    EXPECT_LT(world.state(0).velocity.norm(), 1e-6);
}

TEST(WorldConstraint, BreaksAboveItsForceAndHoldsBelow) {
    for (const double share : {0.9, 1.1}) {
        sim::WorldDefinition definition;
        definition.bodies.push_back(ball({0, 0, 0}));
        definition.constraints.push_back(to_place(0, {0, 0, 0}, {0, 0, 0}, 1e5));
        definition.constraints[0].damping_ratio = 2;
        const double weight = 100 * 4.0 / 3 * M_PI * 0.125 * kG;
        definition.constraints[0].breaking_force = share * weight;
        sim::World world(definition);
        run(world, 300);
        EXPECT_EQ(world.constraint_holds(0), share > 1);
        EXPECT_EQ(world.counts().constraints_broken, share > 1 ? 0u : 1u);
        ASSERT_EQ(world.broken().size(), share > 1 ? 0u : 1u);
        if (share < 1) {
            EXPECT_EQ(world.broken()[0].number, 0);
            EXPECT_LT(world.broken()[0].step, 60u) << "as its load came, in the first second";
        }
        EXPECT_EQ(world.state(0).position.y() > -1, share > 1);
    }
}

TEST(WorldConstraint, AChainKeepsTogetherAndFallsInTwoWhenALinkIsRemoved) {
    sim::WorldDefinition definition;
    for (int i = 0; i < 5; ++i) {
        definition.bodies.push_back(ball({0.0, -1.0 * i, 0}, Fidelity::linear));
        sim::PointConstraint link;
        link.name = "link";
        link.body_a = i;
        link.point_a = {0, 0.5, 0};
        link.body_b = i - 1;
        link.point_b = i == 0 ? Eigen::Vector3d(0, 0.5, 0) : Eigen::Vector3d(0, -0.5, 0);
        link.stiffness = 1e6;
        definition.constraints.push_back(link);
    }
    sim::World world(definition);
    for (int k = 0; k < 3000 && !world.all_asleep(); ++k) world.step();
    ASSERT_TRUE(world.all_asleep());
    EXPECT_NEAR(world.state(4).position.y(), -4, 0.1);
    world.remove_constraint(3);
    run(world, 60);
    EXPECT_NEAR(world.state(2).position.y(), -2, 0.1) << "the upper part still hangs";
    EXPECT_LT(world.state(4).position.y(), -8) << "the lower part falls, woken";
    EXPECT_FALSE(world.constraint_holds(3));
}

TEST(WorldConstraint, APendulumSwingsWithItsClosedFormPeriodAndLosesLittle) {
    // A small swing of a ball on a stiff point 2 m above: T = 2 pi sqrt((I + m l^2) / (m g l)).
    sim::WorldDefinition definition;
    definition.settings.sleeping = false;
    definition.settings.substeps = 16;
    const double l = 2, angle = 0.1;
    definition.bodies.push_back(ball({l * std::sin(angle), -l * std::cos(angle), 0}));
    definition.bodies[0].world_from_body.linear() =
        Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    definition.constraints.push_back(to_place(0, {0, l, 0}, {0, 0, 0}, 1e7));
    sim::World world(definition);
    const sim::RigidMass m = world.rigid_mass(0);
    const double period =
        2 * M_PI * std::sqrt((m.inertia.z() + m.mass * l * l) / (m.mass * kG * l)) * (1 + angle * angle / 16);
    double last = world.state(0).position.x(), first_zero = -1, second_zero = -1;
    for (int k = 0; k < 400 && second_zero < 0; ++k) {
        world.step();
        const double x = world.state(0).position.x();
        if (last > 0 && x <= 0) {
            const double t = world.time_s() - x / (x - last) * definition.settings.dt;
            (first_zero < 0 ? first_zero : second_zero) = t;
        }
        last = x;
    }
    EXPECT_NEAR((second_zero - first_zero) / period, 1, 2e-3);
}

TEST(WorldConstraint, ASwingingChainNeverGainsEnergy) {
    sim::WorldDefinition definition;
    definition.settings.sleeping = false;
    for (int i = 0; i < 3; ++i) {
        definition.bodies.push_back(ball({1.0 * i, 0, 0.1 * i}));
        definition.bodies.back().shape.base.semi_axes = {0.5, 0.2, 0.3};
        sim::PointConstraint link;
        link.name = "link";
        link.body_a = i;
        link.point_a = {-0.5, 0, 0};
        link.body_b = i - 1;
        link.point_b = i == 0 ? Eigen::Vector3d(-0.5, 0, 0) : Eigen::Vector3d(0.5, 0, 0);
        link.stiffness = 1e5;
        definition.constraints.push_back(link);
    }
    sim::World world(definition);
    const double start = world.energy().total(),
                 swing = 3 * world.rigid_mass(0).mass * kG;  // J, a metre's fall
    double lowest = start;
    for (int k = 0; k < 6000; ++k) {
        world.step();
        const double energy = world.energy().total();
        // A symplectic scheme's energy wavers with the step; it may not creep up.
        ASSERT_LT(energy, lowest + 0.01 * swing) << "step " << k;
        lowest = std::min(lowest, energy);
    }
}

TEST(WorldConstraint, MassProportionalDampingBringsASwingToRest) {
    sim::WorldDefinition definition;
    definition.bodies.push_back(ball({1, 0, 0}));
    definition.bodies[0].damping_alpha = 1;
    definition.constraints.push_back(to_place(0, {-1, 0, 0}, {0, 0, 0}, 1e6));
    definition.constraints[0].point_a = {-1, 0, 0};
    sim::World world(definition);
    int steps = 0;
    while (!world.all_asleep() && steps < 3000) world.step(), ++steps;
    EXPECT_TRUE(world.all_asleep());
    EXPECT_NEAR(world.state(0).position.y(), -1, 1e-2) << "it hangs straight down";
}

// A tie breaks as its body is hit; later in the same step a ball that others handed on meets the tie's other body, and that
// island is solved again: from the step's start, with the tie.
TEST(WorldConstraint, AStepThatIsSolvedAgainAfterATieBrokeKeepsMomentum) {
    sim::WorldDefinition d = weightless();
    auto add = [&d](const Eigen::Vector3d& at, const Eigen::Vector3d& velocity, double restitution) {
        sim::WorldBody body = ball(at, sim::Fidelity::rigid, 0.1, 1000);
        body.velocity = velocity, body.restitution = restitution, body.friction = 0;
        d.bodies.push_back(body);
    };
    add({-2.45, 0, 0}, {30, 0, 0}, 0);
    add({0, 0, 0.5}, {0, 0, 0}, 0);
    add({0, 0, 0}, {0, 0, 0}, 0);
    add({0, 0, 3.35}, {0, 0, -30}, 1);
    add({0, 0, 1.1}, {0, 0, 0}, 1);
    add({0, 0, 0.8}, {0, 0, 0}, 1);
    sim::PointConstraint tie;
    tie.name = "tie", tie.body_a = 2, tie.body_b = 1;
    tie.point_a = {0, 0, 0.25}, tie.point_b = {0, 0, -0.25};
    tie.stiffness = 1e4, tie.breaking_force = 200;
    d.constraints.push_back(tie);
    sim::World world(d);
    const Eigen::Vector3d before = momentum_of(world);
    for (int step = 0; step < 12; ++step) {
        world.step();
        EXPECT_LT((momentum_of(world) - before).norm(), 1e-9 * before.norm()) << step;
    }
    EXPECT_EQ(world.counts().constraints_broken, 1u);
    EXPECT_EQ(world.broken().size(), 1u);
    EXPECT_GT(world.counts().solved_again, 1u);
}
