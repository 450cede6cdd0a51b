#include <gtest/gtest.h>

#include <cmath>

#include "shared_scenes.h"

using namespace world_test;

namespace {

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

struct Balance {
    int too_far = 0;  ///< steps of a worker outside 15 % or one body of the average
    std::string where;
};

/// Steps `first` to `last` of all workers: smoothed times against their average.
Balance balance(const Record& record, int workers, std::uint64_t first, std::uint64_t last) {
    std::map<std::uint64_t, std::map<int, sim::WorkerStep>> rows;
    for (const sim::WorkerStep& s : record.steps) rows[s.step][s.worker] = s;
    Balance result;
    for (std::uint64_t step = first; step <= last; ++step) {
        double sum = 0, body = 0;  // the dearest one
        for (const auto& [worker, s] : rows[step]) {
            sum += s.smoothed_s;
            if (s.bodies > 0) body = std::max(body, s.smoothed_s / s.bodies);
        }
        const double mean = sum / workers;
        for (int worker = 0; worker < workers; ++worker) {
            const sim::WorkerStep& s = rows[step][worker];
            if (std::abs(s.smoothed_s - mean) <= std::max(0.15 * mean, body)) continue;
            ++result.too_far;
            result.where += std::to_string(step) + " ";
        }
    }
    return result;
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

TEST(Market, ThirtyBodiesOnOneOfThreeWorkersLevelWithinTenStepsAndAgainAfterAForeignLoad) {
    for (const int seed : {0, 1, 2, 3, 4, 5}) {
        sim::WorldScene scene = thirty();
        scene.world.bodies[0].velocity.x() += 0.1 * seed;
        sim::DistributedSettings settings;
        settings.steps = 500;
        settings.all_to_first = true;
        settings.market.from_step = 50;
        sim::SimulatedProcessors how;
        how.count = 3;
        how.modelled = true;
        how.factor = [](int worker, std::uint64_t step) { return worker == 0 && step >= 150 ? 2.0 : 1.0; };
        Record record;
        const auto result = sim::simulate_processors(scene, settings, how, record);
        EXPECT_EQ(result.refused_messages, 0u) << record.notes;
        for (const std::uint64_t start : {50, 150}) {
            const Balance then = balance(record, 3, start + 10, start + 10);
            EXPECT_EQ(then.too_far, 0) << seed << " at " << then.where;
        }
        // Bodies that meet cost several times more, so every worker's time wanders; one body in 20 steps
        // follows it, a little behind.
        EXPECT_LT(balance(record, 3, 160, 500).too_far, 0.1 * 3 * 340) << seed;
        // What was agreed on by then is registered within two steps.
        EXPECT_LE(most_moved(record, 62, 149), 1) << seed;
        EXPECT_LE(most_moved(record, 162, 500), 1) << seed;
    }
}
