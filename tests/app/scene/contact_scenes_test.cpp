#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>

#include "scene/scene.h"

// The scenes of tests/scenes: each file's head says what is right.

namespace app {
namespace {

using Eigen::Vector3d;

sim::WorldDefinition scene(const std::string& name, std::optional<double> dt_s = {}) {
    return read_scene(std::filesystem::path(MUSICWORLD_SOURCE_DIR) / "tests/scenes" / (name + ".toml"), dt_s)
        .world;
}

void run(sim::World& world, double seconds, double dt) {
    for (int i = static_cast<int>(std::lround(seconds / dt)); i > 0; --i) world.step();
}

constexpr double kSteps[] = {1.0 / 30, 1.0 / 60, 1.0 / 120, 1.0 / 480};

TEST(ContactScenes, BallsDroppedOnAThinTableStayOnIt) {
    for (const double dt : kSteps) {
        const sim::WorldDefinition d = scene("table", dt);
        sim::World world(d);
        run(world, 3, dt);
        ASSERT_EQ(world.bodies(), 26);
        for (int i = 1; i < 26; ++i) EXPECT_NEAR(world.state(i).position.y(), 0.06, 0.005) << i << ", " << dt;
        EXPECT_TRUE(world.quarantined().empty());
    }
}

TEST(ContactScenes, ABallThatPassesAnotherKeepsItsVelocityToTheLastBitAt1To300MetresASecond) {
    for (const double dt : kSteps)
        for (const double speed : {1.0, 10.0, 50.0, 300.0}) {
            sim::WorldDefinition d = scene("ghost", dt);
            d.bodies[1].velocity = {speed, 0, 0};
            sim::World world(d);
            run(world, 2 / speed, dt);
            EXPECT_EQ(world.state(1).velocity, d.bodies[1].velocity) << speed << ", " << dt;
        }
}

TEST(ContactScenes, ACardStaysOnItsSideOfAWallAt10To300MetresASecond) {
    for (const double dt : kSteps)
        for (const double speed : {10.0, 50.0, 150.0, 300.0}) {
            sim::WorldDefinition d = scene("card_through_wall", dt);
            d.bodies[1].velocity = {speed, 0, 0};
            sim::World world(d);
            run(world, 4 / speed + 0.1, dt);
            EXPECT_LT(world.state(1).position.x(), -0.025) << speed << ", " << dt;
            EXPECT_LE(world.state(1).velocity.norm(), speed) << speed << ", " << dt;
        }
}

TEST(ContactScenes, AStiffModalBallRollsAsARigidOneToOnePercent) {
    for (const double dt : kSteps) {
        sim::World world(scene("modal_ball_rolls", dt));
        run(world, 2, dt);
        const double expected = 5.0 / 7 * 9.81 * std::sin(std::numbers::pi / 18);
        EXPECT_NEAR(world.state(0).velocity.norm() / 2, expected, 0.01 * expected) << dt;
    }
}

}  // namespace
}  // namespace app
