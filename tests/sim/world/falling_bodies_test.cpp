#include "falling_bodies.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "bullet_peer.h"

namespace {

using Eigen::Vector3d;
using sim_bench::BulletKind, sim_bench::BulletWorld;

TEST(FallingBalls, StartApartFromEachOtherAndWithinTheBoxForAnyNumber) {
    for (const int count : {1, 4, 25, 100, 400}) {
        const sim::WorldDefinition world = sim_bench::falling_balls(count);
        ASSERT_EQ(world.bodies.size(), static_cast<std::size_t>(count));
        for (std::size_t i = 0; i < world.bodies.size(); ++i) {
            const Vector3d p = world.bodies[i].world_from_body.translation();
            EXPECT_GT(p.y(), 0.5);
            if (count >= 4) {
                EXPECT_LT(std::max(std::abs(p.x()), std::abs(p.z())), sim_bench::box_side(count) / 2 - 0.4);
            }
            for (std::size_t j = 0; j < i; ++j)
                ASSERT_GT((p - world.bodies[j].world_from_body.translation()).norm(), 1.0);
        }
    }
}

double mean_height(int count, const std::function<Vector3d(int)>& position) {
    double sum = 0;
    const double half = sim_bench::box_side(count) / 2;
    for (int i = 0; i < count; ++i) {
        const Vector3d at = position(i);
        EXPECT_GT(at.y(), 0.35) << i;  // a ball of 0.5 m, squashed at most so far
        EXPECT_LT(std::max(std::abs(at.x()), std::abs(at.z())), half - 0.35) << i;
        sum += at.y();
    }
    return sum / count;
}

TEST(FallingBalls, AfterFourSecondsOursAndBulletsLieInTheBoxInPilesOfOneHeight) {
    if (!sim_bench::bullet_is_there()) GTEST_SKIP() << "built without Bullet";
    const int count = 25, steps = 240;
    sim::World soft(sim_bench::falling_balls(count)), stiff(sim_bench::falling_balls(count, 0));
    BulletWorld bullet(sim_bench::falling_balls(count), BulletKind::spheres);
    for (int i = 0; i < steps; ++i) {
        soft.step();
        stiff.step();
        bullet.step();
    }
    const double bullet_height = mean_height(count, [&](int i) { return bullet.position(i); });
    const double stiff_height = mean_height(count, [&](int i) { return stiff.state(i).position; });
    const double soft_height = mean_height(count, [&](int i) { return soft.state(i).position; });
    // Rigid balls roll alike in both; chance alone tells the piles apart. (Bullet's hulls are 4 cm thicker all
    // round, and roll as polyhedra.)
    EXPECT_NEAR(stiff_height, bullet_height, 0.12 * bullet_height);
    // Soft balls of 5 kN carry each other with a contact stiffness of some 50 kN/m: they sag by a tenth and
    // more.
    EXPECT_LT(soft_height, stiff_height);
    EXPECT_GT(soft_height, 0.7 * stiff_height);
}

TEST(FallingBalls, BulletsReducedBallsRestOnTheFloorAndDeform) {
    if (!sim_bench::bullet_is_there()) GTEST_SKIP() << "built without Bullet";
    BulletWorld reduced(sim_bench::falling_balls(4), BulletKind::reduced);
    for (int i = 0; i < 240; ++i) reduced.step();
    for (int i = 0; i < 4; ++i) {
        EXPECT_GT(reduced.position(i).y(), 0.4);
        EXPECT_LT(reduced.position(i).y(), 0.5);  // lower than a stiff one's
    }
}

}  // namespace
