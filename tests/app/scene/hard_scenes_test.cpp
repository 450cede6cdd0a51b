#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>

#include "scene/scene.h"

// The scenes of assets/scenes/hard: each file's head says what is right.

namespace app {
namespace {

using Eigen::Vector3d;

sim::WorldDefinition scene(const std::string& name, std::optional<double> dt_s = {}) {
    return read_scene(std::filesystem::path(MUSICWORLD_SOURCE_DIR) / "assets/scenes/hard" / (name + ".toml"),
                      dt_s)
        .world;
}

void run(sim::World& world, double seconds, double dt) {
    for (int i = static_cast<int>(std::lround(seconds / dt)); i > 0; --i) world.step();
}

/// How far bodies are at the end from where they are put, and on the way there, at most [m].
struct Drift {
    double end = 0, most = 0;
};
Drift drift(const std::string& name, double seconds) {
    const sim::WorldDefinition d = scene(name);
    sim::World world(d);
    Drift drift;
    for (int i = static_cast<int>(std::lround(seconds / d.settings.dt)); i > 0; --i) {
        world.step();
        drift.end = 0;
        for (int body = 0; body < world.bodies(); ++body)
            drift.end =
                std::max(drift.end, (world.state(body).position -
                                     d.bodies[static_cast<std::size_t>(body)].world_from_body.translation())
                                        .norm());
        drift.most = std::max(drift.most, drift.end);
    }
    EXPECT_TRUE(world.quarantined().empty()) << name;
    return drift;
}

/// By how much kinetic and potential energy rise above, and fall below, those of the start [J].
struct Change {
    double up = 0, down = 0;
};
Change energy_change(const std::string& name, double seconds) {
    const sim::WorldDefinition d = scene(name);
    sim::World world(d);
    auto energy = [&world] { return world.energy().kinetic + world.energy().potential; };
    const double first = energy();
    Change change;
    for (int i = static_cast<int>(std::lround(seconds / d.settings.dt)); i > 0; --i) {
        world.step();
        change.up = std::max(change.up, energy() - first);
        change.down = std::max(change.down, first - energy());
    }
    EXPECT_TRUE(world.quarantined().empty()) << name;
    return change;
}

constexpr double kSteps[] = {1.0 / 30, 1.0 / 60, 1.0 / 120, 1.0 / 480};

TEST(HardScenes, BallsDroppedOnAThinTableStayOnIt) {
    for (const double dt : kSteps) {
        const sim::WorldDefinition d = scene("table", dt);
        sim::World world(d);
        run(world, 3, dt);
        int balls = 0;
        for (int i = 0; i < world.bodies(); ++i) {
            if (d.bodies[static_cast<std::size_t>(i)].fixed) continue;
            ++balls;
            EXPECT_NEAR(world.state(i).position.y(), 0.06, 0.005) << i << ", " << dt;
        }
        EXPECT_EQ(balls, 25);
        EXPECT_TRUE(world.quarantined().empty());
    }
}

/// The one body that moves.
std::size_t mover(const sim::WorldDefinition& d) {
    return d.bodies[0].fixed ? 1 : 0;
}

TEST(HardScenes, ABallThatPassesAnotherKeepsItsVelocityToTheLastBitAt1To300MetresASecond) {
    for (const double dt : kSteps)
        for (const double speed : {1.0, 10.0, 50.0, 300.0}) {
            sim::WorldDefinition d = scene("ghost", dt);
            const std::size_t ball = mover(d);
            d.bodies[ball].velocity = {speed, 0, 0};
            sim::World world(d);
            run(world, 2 / speed, dt);
            EXPECT_EQ(world.state(static_cast<int>(ball)).velocity, d.bodies[ball].velocity)
                << speed << ", " << dt;
        }
}

TEST(HardScenes, ACardStaysOnItsSideOfAWallAt10To300MetresASecond) {
    for (const double dt : kSteps)
        for (const double speed : {10.0, 50.0, 150.0, 300.0}) {
            sim::WorldDefinition d = scene("card_through_wall", dt);
            const std::size_t card = mover(d);
            d.bodies[card].velocity = {speed, 0, 0};
            sim::World world(d);
            run(world, 4 / speed + 0.1, dt);
            const sim::WorldBodyState state = world.state(static_cast<int>(card));
            EXPECT_LT(state.position.x(), -0.025) << speed << ", " << dt;
            EXPECT_LE(state.velocity.norm(), speed) << speed << ", " << dt;
        }
}

TEST(HardScenes, AStiffModalBallRollsAsARigidOneToOnePercent) {
    for (const double dt : kSteps) {
        sim::World world(scene("modal_ball_rolls", dt));
        run(world, 2, dt);
        const double expected = 5.0 / 7 * 9.81 * std::sin(std::numbers::pi / 18);
        EXPECT_NEAR(world.state(0).velocity.norm() / 2, expected, 0.01 * expected) << dt;
    }
}

TEST(HardScenes, StacksStandWhereTheyArePut) {
    // Ten and fifteen sway in the first second, by 1 % of a cube.
    EXPECT_LT(drift("boxes_1cm", 3).most, 1e-4);
    const Drift ten = drift("stack10_10cm", 60), fifteen = drift("stack15", 60);
    EXPECT_LT(ten.end, 1e-3);
    EXPECT_LT(ten.most, 2e-3);
    EXPECT_LT(fifteen.end, 1e-2);
    EXPECT_LT(fifteen.most, 2e-2);
    EXPECT_LT(drift("ratio1000", 60).most, 0.1);
}

TEST(HardScenes, JointsKeepEnergy) {
    // Beads that hang at rest; a chain of 1.6 m a link that falls from level.
    EXPECT_LT(energy_change("beads", 6).up, 1e-3 * 13);
    EXPECT_LT(energy_change("chain20", 6).up, 1e-3 * 158);
    const double spin = 91.8;  // of the top [J]
    const Change top = energy_change("top", 10);
    EXPECT_LT(std::max(top.up, top.down), 1e-3 * spin);
    EXPECT_LT(energy_change("double_pendulum", 6).up, 1e-3 * 0.5);
}

}  // namespace
}  // namespace app
