#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "world_bodies.h"

// What free collisions conserve.

using namespace world_test;
using Eigen::Vector3d;
using sim::Fidelity;

namespace {

struct Shot {
    sim::WorldDefinition world;
    double radius = 0;      // of the larger [m]
    double until_past = 0;  // [s]
};

// Two bodies of 1 cm to 10 m, the first at 1 to 100 m/s, off the centre of the second; they turn by less than
// a radian a substep.
Shot shot(Draw& draw, bool boxes, double restitution, double friction) {
    constexpr double kSteps[] = {1.0 / 30, 1.0 / 60, 1.0 / 120, 1.0 / 480};
    constexpr int kSubsteps[] = {1, 2, 4, 7};
    Shot shot;
    shot.world = weightless();
    shot.world.settings.dt = kSteps[draw.below(4)], shot.world.settings.substeps = kSubsteps[draw.below(4)];
    const double a = draw.scale(0.01, 10), b = a * draw.scale(0.4, 2.5), speed = draw.scale(1, 100);
    const Vector3d way = draw.direction();
    const double before = 2 * (a + b) + draw.between(0, 1) * speed * shot.world.settings.dt;
    const Vector3d from = draw.between(0, 0.9) * (a + b) * way.unitOrthogonal() - before * way;
    auto body = [&](const Vector3d& at, double r) {
        sim::WorldBody made = boxes ? box(at, {r, r, r}) : ball(at, Fidelity::rigid, r);
        made.world_from_body.linear() =
            Eigen::AngleAxisd(draw.between(0, 3), draw.direction()).toRotationMatrix();
        made.friction = friction, made.restitution = restitution;
        return made;
    };
    shot.world.bodies = {body(from, a), body({0, 0, 0}, b)};
    shot.world.bodies[0].velocity = speed * way;
    const double most = std::min(speed / a, shot.world.settings.substeps / shot.world.settings.dt);
    shot.world.bodies[0].angular_velocity = draw.between(0, 0.5) * most * draw.direction();
    shot.radius = std::max(a, b);
    shot.until_past = 3 * before / speed;
    return shot;
}

// Runs until two steps after the bodies meet; false: they never do.
bool meet(sim::World& world, const Shot& shot) {
    const Vector3d before = world.state(1).velocity;
    for (int i = static_cast<int>(shot.until_past / shot.world.settings.dt) + 4; i > 0; --i) {
        world.step();
        if (world.state(1).velocity == before) continue;
        run(world, 2);
        return true;
    }
    return false;
}

Vector3d angular_momentum(const sim::World& world) {
    Vector3d sum = Vector3d::Zero();
    for (int i = 0; i < 2; ++i)
        sum += world.rigid_mass(i).mass * world.state(i).position.cross(world.state(i).velocity) +
               world.state(i).angular_momentum;
    return sum;
}

// Of fast pairs: slow ones have contacts that stand still.
bool is_fast(const Shot& shot) {
    return shot.world.bodies[0].velocity.norm() * shot.world.settings.dt > 0.5 * shot.radius;
}

TEST(WorldCollision, FastBodiesKeepTheirAngularMomentumToMillionthsOfWhatTheyExchange) {
    Draw draw(5);
    int hits = 0;
    for (int i = 0; i < 400; ++i) {
        const bool boxes = i % 2 == 1;
        const Shot s = shot(draw, boxes, 0.5 * draw.below(3), 0.4 * draw.below(2));
        if (!is_fast(s)) continue;
        sim::World world(s.world);
        const Vector3d before = angular_momentum(world);
        if (!meet(world, s)) continue;
        ++hits;
        const double exchanged = world.rigid_mass(1).mass * world.state(1).velocity.norm() * s.radius;
        // Rows are in single precision, 6e-8, over ways of many radii; boxes go on to touch as slow pairs do.
        EXPECT_LT((angular_momentum(world) - before).norm(), (boxes ? 3e-4 : 1e-5) * exchanged)
            << "case " << i;
    }
    EXPECT_GT(hits, 50);
}

TEST(WorldCollision, FastBallsThatReboundWithoutFrictionKeepTheirEnergyToHalfAPercent) {
    Draw draw(6);
    for (int i = 0; i < 200; ++i) {
        const Shot s = shot(draw, false, 1, 0);
        if (!is_fast(s)) continue;
        sim::World world(s.world);
        const double before = world.energy().kinetic;
        if (!meet(world, s)) continue;
        EXPECT_NEAR(world.energy().kinetic / before, 1, 0.005) << "case " << i;
    }
}

TEST(WorldCollision, NoCollisionOfBallsOrBoxesGivesEnergy) {
    Draw draw(7);
    for (int i = 0; i < 300; ++i) {
        const Shot s = shot(draw, i % 2 == 1, 0.5 * draw.below(3), 0.4 * draw.below(2));
        sim::World world(s.world);
        const double before = world.energy().kinetic;
        if (!meet(world, s)) continue;
        EXPECT_LT(world.energy().kinetic, 1.03 * before) << "case " << i;
    }
}

}  // namespace
