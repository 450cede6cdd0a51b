#include <gtest/gtest.h>

#include <map>

#include "shared_scenes.h"

using namespace world_test;
using Failure = sim::SimulatedProcessors::Failure;

TEST(Lockstep, EveryStepHasTheHashOfOneProcessWith1To7Workers) {
    const sim::WorldScene scene = busy_scene();
    const std::vector<std::uint64_t> expected = hashes_alone(scene, 120);
    for (const int workers : {1, 2, 3, 7}) {
        Record record;
        const sim::DistributedResult result =
            sim::simulate_processors(scene, lockstep(120), processors(workers), record);
        EXPECT_EQ(record.hashes, expected) << workers;
        EXPECT_TRUE(record.in_order);
        EXPECT_EQ(result.steps, 120u);
        EXPECT_EQ(result.refused_messages, 0u) << record.notes;
        EXPECT_EQ(result.cross_contacts > 0, workers > 1) << "contacts cross workers";
        for (int i = 0; i < workers; ++i) EXPECT_GT(record.own[i], 0) << i << " of " << workers;
    }
}

namespace {
/// Hash and number of bodies as each step begins.
struct AsReady : sim::DistributedObserver {
    void ready(std::uint64_t step, const sim::World& world) override {
        now[step] = {world.bodies(), world.state_hash()};
    }
    std::map<std::uint64_t, std::pair<int, std::uint64_t>> now;
};
}  // namespace

// With the events of the next step, but not those after the last one; who joins then is told of bodies that are there alone.
TEST(Lockstep, ShowsAsAStepBeginsWhatOneProcessShows) {
    sim::WorldScene scene = busy_scene();
    scene.events[0].step = 0, scene.events[1].step = 20;
    for (const std::uint64_t steps : {20, 21, 60}) {
        AsReady expected;
        (void)sim::run_alone(scene, lockstep(steps), expected);
        EXPECT_EQ(expected.now.at(steps).first - expected.now.at(0).first, steps > 20 ? 1 : 0);
        AsReady quiet;
        const double span = sim::simulate_processors(scene, lockstep(steps), processors(3), quiet).elapsed_s;
        EXPECT_EQ(quiet.now, expected.now) << steps;
        for (int i = 0; i < 20; ++i) {
            sim::SimulatedProcessors how = processors(3);
            how.failures = {{span * i / 20, 0, Failure::Kind::join}};
            AsReady shown;
            (void)sim::simulate_processors(scene, lockstep(steps), how, shown);
            EXPECT_EQ(shown.now, expected.now) << steps << " steps, one joins at " << i << "/20";
        }
    }
}

TEST(Lockstep, KeepsItsHashWhenWorkersAreKilledStoppedCutOffOrLeaveAndOthersJoin) {
    const sim::WorldScene scene = busy_scene();
    const std::uint64_t steps = 90;
    const std::vector<std::uint64_t> expected = hashes_alone(scene, steps);
    Record whole;
    const double span = sim::simulate_processors(scene, lockstep(steps), processors(3), whole).elapsed_s;
    for (const Failure::Kind kind : {Failure::Kind::kill, Failure::Kind::stop, Failure::Kind::cut,
                                     Failure::Kind::drain, Failure::Kind::join})
        for (int i = 0; i < 12; ++i) {
            sim::SimulatedProcessors how = processors(3);
            how.silence_s = span / 10;
            how.failures = {{span * (i + 0.37) / 12, i % 3, kind}};
            Record record;
            const sim::DistributedResult result =
                sim::simulate_processors(scene, lockstep(steps), how, record);
            EXPECT_EQ(record.hashes, expected) << static_cast<int>(kind) << " " << i;
            const bool lost = kind < Failure::Kind::drain && kind != Failure::Kind::resume;
            EXPECT_EQ(result.lost, lost ? 1 : 0);
            EXPECT_EQ(result.left, kind == Failure::Kind::drain ? 1 : 0);
            EXPECT_EQ(result.refused_messages > 0, false) << record.notes;
        }
}
