#include <gtest/gtest.h>

#include <cmath>

#include "shared_scenes.h"

using namespace world_test;

namespace {

class Market : public testing::TestWithParam<sim::Pace> {};

/// Thirty like bodies that roll and collide in a box, as in assets/scenes/migration30.toml.
sim::WorldScene thirty() {
    sim::WorldScene scene;
    scene.world = on_floor();
    for (const double side : {-1.0, 1.0}) {
        scene.world.planes.push_back({Eigen::Vector3d(side, 0, 0), -3.5, 0.2, 0.6});
        scene.world.planes.push_back({Eigen::Vector3d(0, 0, side), -3.5, 0.2, 0.6});
    }
    for (int i = 0; i < 30; ++i) {
        sim::WorldBody body = ball({-2.5 + 1.25 * (i % 5) + 0.03 * (i % 7), 0.8 + 1.25 * (i / 15),
                                    -1.25 + 1.25 * (i / 5 % 3) + 0.04 * (i % 4)},
                                   sim::Fidelity::modal);
        body.material = {2e5, 0.3, 300};
        body.friction = 0.3, body.restitution = 0.6;
        body.velocity = {3, 0, 2};
        scene.world.bodies.push_back(body);
    }
    return scene;
}

}  // namespace

namespace {

/// Shares of the time in which a worker was outside 15 % or one body (the dearest) of the average of the
/// smoothed times, as the last reports told whenever the slowest worker ended one of its steps `first` to
/// `last`.
double too_far(const Record& record, int workers, std::uint64_t first, std::uint64_t last) {
    std::map<int, sim::WorkerStep> latest;
    std::uint64_t reached = 0;
    int far = 0, all = 0;
    for (const sim::WorkerStep& report : record.steps) {
        latest[report.worker] = report;
        std::uint64_t slowest = report.step;
        double sum = 0, body = 0;
        for (const auto& [worker, s] : latest) {
            slowest = std::min(slowest, s.step);
            sum += s.smoothed_s;
            if (s.bodies > 0) body = std::max(body, s.smoothed_s / s.bodies);
        }
        if (slowest <= reached) continue;
        reached = slowest;
        if (slowest < first || slowest > last) continue;
        for (int worker = 0; worker < workers; ++worker, ++all)
            far += std::abs(latest[worker].smoothed_s - sum / workers) > std::max(0.15 * sum / workers, body);
    }
    return all > 0 ? static_cast<double>(far) / all : 1;
}

/// The most bodies that changed hands within any 20 steps from `first` on.
int most_moved(const Record& record, std::uint64_t first, std::uint64_t last) {
    int most = 0;
    for (const Record::Move& start : record.moves) {
        int sum = 0;
        for (const Record::Move& move : record.moves)
            if (move.step >= start.step && move.step < start.step + 20 && move.step <= last)
                sum += move.bodies;
        if (start.step >= first && start.step <= last) most = std::max(most, sum);
    }
    return most;
}

}  // namespace

TEST_P(Market, ThirtyBodiesOnOneOfThreeWorkersLevelWithinTenStepsAndAgainAfterAForeignLoad) {
    // A run is chaotic: bodies rebound, and what they cost depends on who meets whom. So of many starts, none of them
    // chosen, at least half have to do; without trades none does.
    constexpr int kRuns = 12;
    int failed = 0;
    for (int seed = 1; seed <= kRuns; ++seed) {
        bool good = true;
        sim::WorldScene scene = thirty();
        scene.world.bodies[0].velocity.x() += 0.02 * seed;
        sim::DistributedSettings settings;
        settings.pace = GetParam();
        settings.bound = GetParam() == sim::Pace::bounded ? 4 : 0;
        settings.steps = 500;
        settings.all_to_first = true;
        settings.market.from_step = 50;
        sim::SimulatedProcessors how;
        how.count = 3;
        how.modelled = true;
        how.latency_s = 2e-5;
        how.factor = [](int worker, std::uint64_t step) { return worker == 0 && step >= 150 ? 2.0 : 1.0; };
        Record record;
        const auto result = sim::simulate_processors(scene, settings, how, record);
        EXPECT_EQ(result.refused_messages, 0u) << record.notes;
        for (const std::uint64_t start : {50, 150}) {
            if (settings.bound == 0) {
                good = good && too_far(record, 3, start + 10, start + 10) == 0;
            } else {
                // Bodies change hands only when the seller has come to the buyer's step: it takes about twice
                // as long, and a worker that is ahead tells of what it bought later.
                good = good && too_far(record, 3, start + 20, start + 80) < 0.35;
            }
        }
        // Bodies that meet cost several times more, so every worker's time wanders; one body in 20 steps
        // follows it, a little behind.
        good = good && too_far(record, 3, 160, 500) < 0.15;
        const int most = settings.bound > 0 ? 2 : 1;
        good = good && most_moved(record, 70, 149) <= most && most_moved(record, 180, 500) <= most;
        failed += !good;
    }
    EXPECT_LE(failed, kRuns / 2);
}

INSTANTIATE_TEST_SUITE_P(Paces, Market, testing::Values(sim::Pace::lockstep, sim::Pace::bounded),
                         [](const auto& pace) {
                             return pace.param == sim::Pace::lockstep ? "Lockstep" : "Bounded";
                         });
