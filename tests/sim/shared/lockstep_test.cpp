#include <gtest/gtest.h>

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
