#pragma once
#include "world_bodies.h"

// Scenes with islands so large that threads and partners share them out.

namespace world_test {

/// A box full of balls that touch from the first steps on: one island, in several slabs.
inline sim::WorldDefinition pile() {
    sim::WorldDefinition world = on_floor();
    for (const double side : {-1.0, 1.0}) {
        world.planes.push_back({Eigen::Vector3d(side, 0, 0), -6.2});
        world.planes.push_back({Eigen::Vector3d(0, 0, side), -2.2});
    }
    Draw draw(3);
    for (int i = 0; i < 200; ++i) {
        const sim::Fidelity fidelity = i % 3 == 0   ? sim::Fidelity::rigid
                                       : i % 3 == 1 ? sim::Fidelity::linear
                                                    : sim::Fidelity::modal;
        world.bodies.push_back(
            ball({-5.6 + 1.01 * (i % 12), 0.5 + 0.99 * (i / 48), -1.5 + 1.01 * (i / 12 % 4)}, fidelity));
        world.bodies.back().restitution = i % 5 == 0 ? 0.5 : 0;
        world.bodies.back().velocity = draw.direction();
    }
    world.bodies[1].motion = {{0, world.bodies[1].world_from_body.translation()},
                              {1, world.bodies[1].world_from_body.translation() + Eigen::Vector3d::UnitX()}};
    return world;
}

inline sim::WorldDefinition random_scene(unsigned seed) {
    Draw draw(seed);
    sim::WorldDefinition world = on_floor();
    world.settings.substeps = 1 + draw.below(6);
    const int bodies = 20 + draw.below(130), across = 3 + draw.below(5);
    for (int i = 0; i < bodies; ++i) {
        const Eigen::Vector3d at(1.05 * (i % across), 0.6 + 1.05 * (i / across / across),
                                 1.05 * (i / across % across));
        // Few kinds: each takes milliseconds to make.
        const double size = 0.3 + 0.1 * draw.below(3), density = 100 << draw.below(3);
        const bool round = draw.below(2) == 0;
        sim::WorldBody body =
            round ? ball(at, draw.below(2) == 0 ? sim::Fidelity::rigid : sim::Fidelity::linear, size, density)
                  : box(at, {size, 0.4, 0.3}, density);
        body.velocity = draw.between(0, 8) * draw.direction();
        body.angular_velocity = draw.between(0, 3) * draw.direction();
        body.restitution = draw.below(3) == 0 ? draw.between(0, 1) : 0;
        body.fixed = draw.below(30) == 0;
        world.bodies.push_back(body);
    }
    for (int i = bodies < 50 ? draw.below(6) : 0; i > 0; --i) {
        sim::PointConstraint link;
        link.name = "link";
        link.body_a = draw.below(bodies), link.body_b = -1;
        link.point_b = world.bodies[std::size_t(link.body_a)].world_from_body.translation();
        link.stiffness = draw.scale(100, 1e5);
        if (!world.bodies[std::size_t(link.body_a)].fixed) world.constraints.push_back(link);
    }
    return world;
}

/// Bodies of all kinds and shapes that nothing makes rebound, thrown and spinning into a narrow box, some tied by soft springs:
/// soon one island, with impacts in many steps, whose frames turn.
inline sim::WorldDefinition heap(unsigned seed) {
    Draw draw(seed);
    sim::WorldDefinition world = on_floor();
    world.settings.substeps = 2 + draw.below(4);
    for (const double side : {-1.0, 1.0}) {
        world.planes.push_back({Eigen::Vector3d(side, 0, 0), -4.4});
        world.planes.push_back({Eigen::Vector3d(0, 0, side), -1.3});
    }
    const int bodies = 120 + draw.below(60);
    for (int i = 0; i < bodies; ++i) {
        const Eigen::Vector3d at(-3.9 + 1.02 * (i % 8), 0.5 + 0.9 * (i / 24), -0.95 + 0.95 * (i / 8 % 3));
        const int kind = draw.below(4);
        sim::WorldBody body = kind == 0   ? box(at, {0.45, 0.25, 0.3}, 300)
                              : kind == 1 ? ball(at, sim::Fidelity::rigid, 0.45)
                              : kind == 2 ? ball(at, sim::Fidelity::linear, 0.45)
                                          : ball(at, sim::Fidelity::modal, 0.45);
        if (kind > 0) body.shape.base.semi_axes[draw.below(3)] *= 0.7;
        body.velocity = draw.between(0, 6) * draw.direction();
        body.angular_velocity = draw.between(0, 20) * draw.direction();
        world.bodies.push_back(body);
    }
    for (int i = 0; i < 4; ++i) {
        sim::PointConstraint tie;
        tie.name = "tie";
        tie.body_a = draw.below(bodies - 1), tie.body_b = i % 2 == 0 ? tie.body_a + 1 : -1;
        if (i % 2 == 1) tie.point_b = world.bodies[std::size_t(tie.body_a)].world_from_body.translation();
        tie.point_a = {0.2, 0, 0};
        tie.stiffness = 300, tie.damping_ratio = 0.1;
        tie.collide = i % 2 == 1;
        world.constraints.push_back(tie);
    }
    // In the midst one stands still: what strikes it gets an impulse from outside.
    int still = 36;
    const auto is_tied = [&still](const sim::PointConstraint& tie) {
        return tie.body_a == still || tie.body_b == still;
    };
    while (std::ranges::any_of(world.constraints, is_tied)) ++still;
    sim::WorldBody& fixed = world.bodies[std::size_t(still)];
    fixed.fixed = true, fixed.velocity.setZero(), fixed.angular_velocity.setZero();
    return world;
}

// Piles, sleepers that are woken, constraints that tie and break, in one small box.
inline sim::WorldDefinition sleepers_and_ties() {
    sim::WorldDefinition d;
    d.settings.sleep_speed = 0.1;
    d.planes.push_back({Eigen::Vector3d::UnitY(), 0, 0.5, 0});
    auto add = [&d](const Eigen::Vector3d& at, const Eigen::Vector3d& velocity, sim::Fidelity fidelity,
                    double restitution) {
        sim::WorldBody body;
        body.name = "body " + std::to_string(d.bodies.size());
        body.shape.base.semi_axes = Eigen::Vector3d(0.5, 0.4, 0.45);
        body.shape.base.e1 = body.shape.base.e2 = 0.3;
        body.material = {1e6, 0.3, 300};
        body.fidelity.fidelity = fidelity;
        body.fidelity.modes = 12;
        body.triangles = 180;
        body.restitution = restitution;
        body.damping_alpha = 0.5;
        body.world_from_body.translation() = at;
        body.velocity = velocity;
        d.bodies.push_back(body);
    };
    // Two piles apart, and one body that comes down on the second when most of both sleep.
    for (int i = 0; i < 4; ++i) add({0.3 * (i % 2), 0.5 + 0.9 * i, 0}, {0, 0, 0}, sim::Fidelity::modal, 0);
    for (int i = 0; i < 4; ++i)
        add({4 + 0.3 * (i % 2), 0.5 + 0.9 * i, 0.2}, {0, 0, 0},
            i % 2 ? sim::Fidelity::linear : sim::Fidelity::rigid, 0.3);
    add({50, 0.5, 0.1}, {-24, 45, 0}, sim::Fidelity::modal, 0.5);
    add({1, 6, 3}, {0, 0, 0}, sim::Fidelity::modal, 0);
    add({1, 7, 3}, {0, 0, 0}, sim::Fidelity::modal, 0);
    sim::PointConstraint hanging;
    hanging.name = "hanging";
    hanging.body_a = 9, hanging.point_a = {0, 0.4, 0}, hanging.point_b = {1, 6.4, 3};
    hanging.stiffness = 2e4, hanging.breaking_force = 3000;
    d.constraints.push_back(hanging);
    sim::PointConstraint tied;
    tied.name = "tied";
    tied.body_a = 9, tied.point_a = {0.5, 0, 0}, tied.body_b = 10, tied.point_b = {0.5, 0, 0};
    tied.stiffness = 1e4;
    d.constraints.push_back(tied);
    return d;
}

}  // namespace world_test
