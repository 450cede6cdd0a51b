#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "sim/distributed_world.h"
#include "sim/errors.h"

namespace sim {
namespace {

WorldBody ball(const std::string& name, double height) {
    WorldBody body;
    body.name = name;
    body.shape.base.semi_axes = Eigen::Vector3d::Constant(0.3);
    body.fidelity.fidelity = Fidelity::rigid;
    body.world_from_body.translation() = Eigen::Vector3d(0, height, 0);
    return body;
}

/// One ball that falls; before step 2 another comes.
WorldScene one_and_one_later() {
    WorldScene scene;
    scene.world.bodies = {ball("first", 1)};
    scene.later = {ball("late", 3)};
    scene.events = {{.step = 2, .removed = {}, .first = 0, .end = 1, .slowing = {}}};
    return scene;
}

/// What was told, a word a call.
struct Log : DistributedObserver {
    void at(std::uint64_t step, const World& world) override { add("at", step, world.bodies()); }
    void ready(std::uint64_t step, const World& world) override { add("ready", step, world.bodies()); }
    void worked(const WorkerStep& step) override {
        add("worked", step.step, step.bodies);
        EXPECT_EQ(step.worker, 0);
    }
    void add(const std::string& what, std::uint64_t step, int bodies) {
        told.push_back(what + " " + std::to_string(step) + ": " + std::to_string(bodies));
    }
    std::vector<std::string> told;
};

TEST(RunAlone, TellsEachStepAndABodyThatComesIsReadyBeforeItsFirstStep) {
    const WorldScene scene = one_and_one_later();
    DistributedSettings settings;
    settings.steps = 3;
    Log log;
    const DistributedResult result = run_alone(scene, settings, log);
    EXPECT_EQ(log.told, (std::vector<std::string>{"at 0: 1", "ready 0: 1", "worked 1: 1", "at 1: 1",
                                                  "ready 1: 1", "worked 2: 1", "at 2: 1", "ready 2: 2",
                                                  "worked 3: 2", "at 3: 2", "ready 3: 2"}));
    EXPECT_EQ(result.steps, 3u);
    EXPECT_EQ(result.workers, 0);
    EXPECT_GE(result.elapsed_s, 0);
    const double weight =
        9.81 * World(scene.world).rigid_mass(0).mass;  // of one for three steps, of two for one
    EXPECT_NEAR(result.outside_impulse.y(), -weight * 4 * scene.world.settings.dt, 1e-9);
}

TEST(RunAlone, UntilRestGoesOnToTheLastEventAndEndsWhenAllSleep) {
    WorldScene scene;
    scene.world.planes.push_back({});
    WorldBody block = ball("block", 0.3);
    scene.world.bodies = {block};
    scene.events = {{.step = 200, .removed = {}, .first = 0, .end = 0, .slowing = {}}};
    DistributedSettings settings;
    settings.steps = 2000;
    settings.until_rest = true;
    DistributedObserver silent;
    const DistributedResult result = run_alone(scene, settings, silent);
    EXPECT_TRUE(result.rest_reached);
    EXPECT_EQ(result.steps, 200u);  // it slept long before
    settings.steps = 5;
    EXPECT_FALSE(run_alone(scene, settings, silent).rest_reached);
}

TEST(RunAlone, AConstraintThatBrokeIsNotRemovedAgain) {
    WorldScene scene;
    scene.world.settings.gravity = Eigen::Vector3d::Zero();
    scene.world.bodies = {ball("a", 0), ball("b", 5)};
    PointConstraint joint;
    joint.body_a = 0, joint.body_b = -1;
    scene.world.constraints = {joint};
    scene.events = {{.step = 40, .removed = {0}, .first = 0, .end = 0, .slowing = {}},
                    {.step = 80, .removed = {0}, .first = 0, .end = 0, .slowing = {}}};
    struct Sleepers : DistributedObserver {
        void ready(std::uint64_t step, const World& world) override {
            if (step == 80) asleep_at_80 = world.all_asleep();
        }
        bool asleep_at_80 = false;
    } sleepers;
    DistributedSettings settings;
    settings.steps = 81;
    (void)run_alone(scene, settings, sleepers);
    EXPECT_TRUE(sleepers.asleep_at_80);  // the second removal wakes nobody
}

TEST(Errors, AreOneLineWithPlaceFoundAndExpectedAndKnowWhetherTheyNameAPlace) {
    WorldScene scene = one_and_one_later();
    scene.world.settings.dt = 1;
    DistributedSettings settings;
    DistributedObserver silent;
    try {
        (void)run_alone(scene, settings, silent);
        FAIL();
    } catch (const InputError& error) {
        EXPECT_STREQ(error.what(), "settings: dt [s]: found 1, expected 1e-06 to 0.25");
        EXPECT_TRUE(error.names_place());
    }
    try {
        DistributedLaunch launch;
        launch.processes.count = 300;
        (void)run_distributed(one_and_one_later(), settings, launch, silent);
        FAIL();
    } catch (const InputError& error) {
        EXPECT_STREQ(error.what(), "found 300 workers, expected 0 to 256");
        EXPECT_FALSE(error.names_place());
    }
}

}  // namespace
}  // namespace sim
