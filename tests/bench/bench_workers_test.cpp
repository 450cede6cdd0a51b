#include "bench/bench_workers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "scene/scene.h"

namespace app {
namespace {

TEST(MeasuredRun, StripsShareOutEveryBodyOnceAndEveryWallIsBetweenNeighbours) {
    const Scene scene = read_scene(find_scene("benchmark25"));
    std::multiset<std::string> names;
    for (int k = 0; k < 3; ++k) {
        const sim::WorldDefinition strip = strip_of(scene.world, k, 3);
        EXPECT_NEAR(double(strip.bodies.size()), 25.0 / 3, 1);
        EXPECT_EQ(strip.planes.size(), scene.world.planes.size() + (k == 1 ? 2 : 1));
        for (const sim::WorldBody& body : strip.bodies) {
            names.insert(body.name);
            for (const sim::WorldPlane& plane : strip.planes)  // no body is in a wall
                EXPECT_GT(plane.normal.dot(body.world_from_body.translation()), plane.offset + 0.5 - 1e-9)
                    << body.name;
        }
        EXPECT_NO_THROW(sim::World{strip});
    }
    EXPECT_EQ(names.size(), 25u);
    EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), 25u);
}

MeasuredRun run_of(const std::vector<sim::WorkerStep>& steps) {
    MeasuredRun run;
    run.steps = steps;
    for (const sim::WorkerStep& step : steps) run.history.add(step);
    return run;
}

TEST(MeasuredRun, ABarrierCostsTheLongestOfEachStepAndUnevennessIsInUnitsOfWhatIsAllowed) {
    const auto step = [](int worker, std::uint64_t number, double seconds, int bodies) {
        return sim::WorkerStep{
            .worker = worker, .step = number, .seconds = seconds, .smoothed_s = seconds, .bodies = bodies};
    };
    const MeasuredRun run =
        run_of({step(0, 1, 3, 100), step(1, 1, 1, 100), step(1, 2, 5, 100), step(0, 2, 2, 100)});
    EXPECT_EQ(run.with_barrier_s(), 3 + 5);
    // At step 1 the average is 2 s, each is 1 s from it, 15 % are 0.3 s.
    EXPECT_NEAR(unevenness_at(run, 1), 1 / 0.3, 1e-12);
    // With one body of 2 s a worker is allowed to be 2 s off.
    EXPECT_NEAR(unevenness_at(run_of({step(0, 1, 2, 1), step(1, 1, 0, 0)}), 1), 0.5, 1e-12);
}

TEST(MeasuredRun, TradesAreCountedInTheBusiestWindow) {
    MeasuredRun run;
    for (const std::uint64_t at : {5u, 52u, 60u, 71u, 72u, 300u}) run.trades.push_back({at, 1, 0, 1});
    EXPECT_EQ(most_trades(run, 50, 500, 20), 3);  // 60, 71, 72
    EXPECT_EQ(most_trades(run, 50, 71, 20), 2);
    EXPECT_EQ(most_trades(run, 100, 300, 20), 0);
}

TEST(BenchWorkers, TwentyFiveBallsOnTwoProcessorsGiveEveryFigureOfEveryPart) {
    WorkersBenchOptions options;
    options.bodies = {25};
    options.workers = {1, 2};
    options.steps = 20;
    options.processors.modelled = true;
    options.only = {"speedup", "stragglers", "bound", "migration"};
    const WorkersBench bench = bench_workers(options, [](const std::string&) {});
    std::map<std::string, double> figures;
    for (const BenchResult& result : bench.report.results) figures[result.name] = result.value;
    EXPECT_EQ(figures.at("bodies25_workers1_async_speed_up"), 1);
    EXPECT_GT(figures.at("bodies25_workers2_ceiling_speed_up"), 1);
    for (const char* name :
         {"bodies25_workers2_async_of_ceiling", "bodies25_workers2_bytes_per_body_step",
          "straggler_permanent_async_balanced_over_lockstep", "straggler_unsteady_b4_async_over_lockstep",
          "straggler_wandering_b16_async_over_barrier", "bound16_height_at_end", "migration_bodies_traded"})
        EXPECT_GT(figures[name], 0) << name;
    EXPECT_EQ(figures.at("bound0_apart_after_a_second"), 0);
    EXPECT_EQ(bench.bounds.size(), 7u);
    EXPECT_EQ(bench.migration.workers().size(), 3u);
    const std::string csv = figures_of(bench).tables.at("speed_up.csv");
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 3);
}

}  // namespace
}  // namespace app
