#include <gtest/gtest.h>

#include <cstdlib>

#include "shared_scenes.h"

using namespace world_test;
using Failure = sim::SimulatedProcessors::Failure;
using Kind = Failure::Kind;

namespace {

constexpr std::uint64_t kSteps = 30;
constexpr int kWorkers = 3;

// One worker starts with everything; trades from the third step on.
sim::DistributedSettings trading(sim::Pace pace) {
    sim::DistributedSettings settings;
    settings.pace = pace;
    settings.bound = pace == sim::Pace::bounded ? 4 : 0;
    settings.steps = kSteps;
    settings.all_to_first = true;
    settings.market.from_step = 3;
    return settings;
}

sim::SimulatedProcessors processors() {
    sim::SimulatedProcessors how;
    how.count = kWorkers;
    how.modelled = true;
    return how;
}

int moving_bodies(const sim::WorldScene& scene) {
    int count = static_cast<int>(scene.later.size());
    for (const sim::WorldBody& body : scene.world.bodies) count += !body.fixed;
    return count;
}

// Failures of every kind and worker, at times that lie close together over all of the trading.
std::vector<std::vector<Failure>> failures(double elapsed, double silence) {
    const int times = std::getenv("MUSICWORLD_LONG") ? 60 : 12;
    std::vector<std::vector<Failure>> all;
    for (const Kind kind : {Kind::kill, Kind::stop, Kind::cut, Kind::drain, Kind::join})
        for (int worker = 0; worker < kWorkers; ++worker)
            for (int i = 0; i < times; ++i) {
                const double at = elapsed * (0.08 + 0.5 * (i + 0.3 * worker) / times);
                all.push_back({{at, worker, kind}});
                // Half of the stopped ones go on before anybody notices, half after.
                if (kind == Kind::stop)
                    all.back().push_back({at + silence * (i % 2 ? 0.5 : 1.5), worker, Kind::resume});
                // Some lose the next one, too, while their bodies are being shared out.
                if (i % 3 == 0 && kind != Kind::join)
                    all.back().push_back({at + silence * 1.01, (worker + 1) % kWorkers, kind});
                if (i % 4 == 0) all.back().push_back({at + silence * 1.2, 0, Kind::join});
            }
    return all;
}

class TradeFailures : public testing::TestWithParam<sim::Pace> {};

}  // namespace

TEST_P(TradeFailures, AtEveryStageOfATradeLeaveEveryBodyWithOneOwnerAndTheRunFinished) {
    const sim::WorldScene scene = busy_scene();
    const sim::DistributedSettings settings = trading(GetParam());
    Record whole;
    const auto unharmed = sim::simulate_processors(scene, settings, processors(), whole);
    ASSERT_GE(unharmed.trades, 2u);
    EXPECT_EQ(unharmed.refused_messages, 0u) << whole.notes;
    const double silence = unharmed.elapsed_s / 8;
    std::uint64_t reowned = 0;
    for (const std::vector<Failure>& some : failures(unharmed.elapsed_s, silence)) {
        sim::SimulatedProcessors how = processors();
        how.silence_s = silence;
        how.failures = some;
        Record record;
        const sim::DistributedResult result = sim::simulate_processors(scene, settings, how, record);
        SCOPED_TRACE(std::to_string(static_cast<int>(some[0].kind)) + " of " +
                     std::to_string(some[0].worker) + " at " + std::to_string(some[0].time_s));
        EXPECT_EQ(result.steps, kSteps);
        EXPECT_TRUE(record.in_order);
        ASSERT_EQ(record.hashes.size(), kSteps + 1);
        if (GetParam() == sim::Pace::lockstep) {
            EXPECT_EQ(record.hashes, whole.hashes);
        }
        int own = 0;
        for (const auto& [number, bodies] : record.own) {
            EXPECT_GE(bodies, 0) << "nobody gives what it has not";
            own += bodies;
        }
        EXPECT_EQ(own, moving_bodies(scene));
        reowned += static_cast<std::uint64_t>(result.bodies_reowned);
    }
    EXPECT_GT(reowned, 100u) << "failures met workers that owned bodies";
}

INSTANTIATE_TEST_SUITE_P(Paces, TradeFailures, testing::Values(sim::Pace::lockstep, sim::Pace::bounded),
                         [](const auto& pace) {
                             return pace.param == sim::Pace::lockstep ? "Lockstep" : "Bounded";
                         });
