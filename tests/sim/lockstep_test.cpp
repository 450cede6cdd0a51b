#include <gtest/gtest.h>

#include "shared_scenes.h"

using namespace world_test;
using Failure = sim::SimulatedProcessors::Failure;

namespace {

sim::DistributedSettings lockstep(std::uint64_t steps) {
    sim::DistributedSettings settings;
    settings.steps = steps;
    return settings;
}

sim::SimulatedProcessors processors(int count) {
    sim::SimulatedProcessors how;
    how.count = count;
    how.modelled = true;
    return how;
}

std::vector<std::uint64_t> hashes_alone(const sim::WorldScene& scene, std::uint64_t steps) {
    std::vector<std::uint64_t> hashes;
    for (std::uint64_t step = 0; step <= steps; ++step) hashes.push_back(alone(scene, step).state_hash());
    return hashes;
}

// One worker starts with everything; trades from the third step on.
sim::DistributedSettings trading(std::uint64_t steps) {
    sim::DistributedSettings settings = lockstep(steps);
    settings.all_to_first = true;
    settings.market.from_step = 3;
    return settings;
}

int moving_bodies(const sim::WorldScene& scene) {
    int count = static_cast<int>(scene.later.size());
    for (const sim::WorldBody& body : scene.world.bodies) count += !body.fixed;
    return count;
}

}  // namespace

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

TEST(Lockstep, WhateverFailsAtWhateverStageOfATradeEveryBodyHasOneOwnerAndTheHashIsKept) {
    const sim::WorldScene scene = busy_scene();
    const std::uint64_t steps = 30;
    const std::vector<std::uint64_t> expected = hashes_alone(scene, steps);
    Record whole;
    const auto unharmed = sim::simulate_processors(scene, trading(steps), processors(3), whole);
    EXPECT_EQ(whole.hashes, expected);
    ASSERT_GE(unharmed.trades, 3u);
    int during_trades = 0;
    for (const Failure::Kind kind : {Failure::Kind::kill, Failure::Kind::stop, Failure::Kind::cut,
                                     Failure::Kind::drain, Failure::Kind::join})
        for (int worker = 0; worker < 3; ++worker)
            for (int i = 0; i < 40; ++i) {
                sim::SimulatedProcessors how = processors(3);
                how.silence_s = unharmed.elapsed_s / 8;
                const double at = unharmed.elapsed_s * (0.08 + 0.5 * i / 40);
                how.failures = {{at, worker, kind}};
                // Half of the stopped ones go on before anybody notices, half after.
                if (kind == Failure::Kind::stop)
                    how.failures.push_back(
                        {at + how.silence_s * (i % 2 ? 0.5 : 1.5), worker, Failure::Kind::resume});
                Record record;
                const sim::DistributedResult result =
                    sim::simulate_processors(scene, trading(steps), how, record);
                ASSERT_EQ(record.hashes, expected) << static_cast<int>(kind) << " " << worker << " " << i;
                int own = 0;
                for (const auto& [number, bodies] : record.own) {
                    EXPECT_GE(bodies, 0);
                    own += bodies;
                }
                EXPECT_EQ(own, moving_bodies(scene));
                EXPECT_TRUE(result.lost + result.left == 0 || record.own[worker] == 0);
                during_trades += result.bodies_reowned > 0;
            }
    EXPECT_GT(during_trades, 100) << "of 360";
}
