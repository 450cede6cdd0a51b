#include <gtest/gtest.h>

#include <cmath>

#include "shared_scenes.h"

using namespace world_test;

namespace {

using Failure = sim_bench::SimulatedProcessors::Failure;

}  // namespace

// It throws if a worker did otherwise the second time.
TEST(SimulatedProcessors, ThatRepeatTheirWorkAloneLeaveTheBitsAlsoThroughDrainsJoinsAndKills) {
    const sim::WorldScene scene = busy_scene(12);
    for (const int bound : {0, 3}) {
        sim::DistributedSettings settings = for_steps(120);
        settings.bound = bound;
        sim_bench::SimulatedProcessors how = processors(3);
        how.silence_s = 0.01;
        how.failures = {{0.002, 1, Failure::Kind::drain},
                        {0.004, 0, Failure::Kind::join},
                        {0.006, 2, Failure::Kind::kill}};
        Record once, twice;
        const sim_bench::SimulatedResult result = sim_bench::simulate_processors(scene, settings, how, once);
        EXPECT_EQ(result.cold_caches, 1);
        EXPECT_EQ(result.left + result.lost, 2) << once.notes;
        how.repeat_alone = true;
        const sim_bench::SimulatedResult repeated =
            sim_bench::simulate_processors(scene, settings, how, twice);
        EXPECT_EQ(twice.hashes, once.hashes);
        EXPECT_EQ(repeated.elapsed_s, result.elapsed_s);
        EXPECT_GT(repeated.cold_caches, 0);
        EXPECT_TRUE(std::isfinite(repeated.cold_caches));
    }
}

// What they publish in between is rounded (update_codec.h).
TEST(SimulatedProcessors, OutOfStepTheLastStatesAreExact) {
    sim::WorldScene scene;
    for (int i = 0; i < 9; ++i) {  // touch nothing
        sim::WorldBody body = i % 2 == 0 ? ball({3. * i, 0, 0}) : box({3. * i, 0, 0}, {0.3, 0.4, 0.5});
        body.name += std::to_string(i);
        body.velocity = {0.1 * i, 1, 0.3}, body.angular_velocity = {1, 0.2 * i, 3};
        scene.world.bodies.push_back(body);
    }
    const std::vector<std::uint64_t> alone = hashes_alone(scene, 40);
    sim::DistributedSettings settings = for_steps(40);
    settings.bound = 4;
    Record record;
    (void)sim_bench::simulate_processors(scene, settings, processors(3), record);
    EXPECT_EQ(record.hashes.back(), alone.back());
    EXPECT_NE(record.hashes.at(20), alone.at(20)) << "else this shows nothing";
}

TEST(SimulatedProcessors, TellTheirOwnTimeAsProcessorTime) {
    Record record;
    const sim::DistributedResult result =
        sim_bench::simulate_processors(busy_scene(8), for_steps(10), processors(2), record);
    double sum = 0;
    for (const sim::WorkerStep& step : record.steps) {
        EXPECT_EQ(step.processor_s, step.seconds);
        sum += step.processor_s;
    }
    EXPECT_GT(sum, 0);
    EXPECT_NEAR(result.cpu_s, sum, 1e-12);
}
