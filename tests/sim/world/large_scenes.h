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

}  // namespace world_test
