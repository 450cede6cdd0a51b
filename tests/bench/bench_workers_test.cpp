#include "bench/bench_workers.h"

#include <gtest/gtest.h>
#include <shared_run.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

namespace app {
namespace {

using sim_bench::SharedRun;

SharedRun run_of(const std::vector<sim::WorkerStep>& steps) {
    SharedRun run;
    run.steps = steps;
    return run;
}

TEST(SharedRun, TheCriticalPathIsTheLongestOfEachStepAndUnevennessIsInUnitsOfWhatIsAllowed) {
    const auto step = [](int worker, std::uint64_t number, double seconds, int bodies) {
        return sim::WorkerStep{.worker = worker,
                               .step = number,
                               .seconds = 10 * seconds,  // by the wall clock
                               .smoothed_s = seconds,
                               .processor_s = seconds,
                               .bodies = bodies};
    };
    const SharedRun run =
        run_of({step(0, 1, 3, 100), step(1, 1, 1, 100), step(1, 2, 5, 100), step(0, 2, 2, 100)});
    EXPECT_EQ(run.critical_path_s(), 3 + 5);
    EXPECT_EQ(run.critical_path_s(1), 1 + 5);  // one step ahead: nobody waits
    const SharedRun third = run_of({step(0, 1, 3, 1), step(1, 1, 1, 1), step(0, 2, 3, 1), step(1, 2, 1, 1),
                                    step(0, 3, 1, 1), step(1, 3, 9, 1)});
    EXPECT_EQ(third.critical_path_s(1), 3 + 9);  // the third waits for the other's first
    // At step 1 the average is 2 s, each is 1 s from it, 15 % are 0.3 s.
    EXPECT_NEAR(unevenness_at(run, 1), 1 / 0.3, 1e-12);
    // With one body of 2 s a worker is allowed to be 2 s off.
    EXPECT_NEAR(unevenness_at(run_of({step(0, 1, 2, 1), step(1, 1, 0, 0)}), 1), 0.5, 1e-12);
}

TEST(SharedRun, TradesAreCountedInTheBusiestWindow) {
    SharedRun run;
    for (const std::uint64_t at : {5u, 52u, 60u, 71u, 72u, 300u}) run.trades.push_back({at, 1, 0, 1});
    EXPECT_EQ(most_trades(run, 50, 500, 20), 3);  // 60, 71, 72
    EXPECT_EQ(most_trades(run, 50, 71, 20), 2);
    EXPECT_EQ(most_trades(run, 100, 300, 20), 0);
}

std::map<std::string, double> figures_by_name(const WorkersBench& bench) {
    std::map<std::string, double> figures;
    for (const BenchResult& result : bench.report.results) figures[result.name] = result.value;
    return figures;
}

TEST(BenchWorkers, TwentyFiveBallsOnTwoProcessorsGiveEveryFigureOfEveryPart) {
    WorkersBenchOptions options;
    options.bodies = {25};
    options.workers = {1, 2};
    options.steps = 20;
    options.processors.modelled = true;
    options.only = {"speedup", "stragglers", "bound", "migration"};
    const WorkersBench bench = bench_workers(options, [](const std::string&) {});
    std::map<std::string, double> figures = figures_by_name(bench);
    EXPECT_EQ(figures.at("bodies25_workers1_bounded_speed_up"), 1);
    EXPECT_LE(figures.at("bodies25_workers2_bounded_speed_up"),
              2);  // costs are counted: as many as there are
    EXPECT_EQ(figures.at("bodies25_workers2_bounded_cold_caches"), 1);
    for (const char* name :
         {"bodies25_workers2_bounded_speed_up", "bodies25_workers2_bytes_per_body_step",
          "bodies25_workers2_barrier_speed_up", "straggler_permanent_bounded_balanced_over_barrier",
          "straggler_unsteady_b4_bounded_over_barrier",
          "straggler_permanent_each_bounded_balanced_over_barrier_least",
          "straggler_wandering_b16_bounded_over_barrier", "bound16_height_at_end", "migration_bodies_traded"})
        EXPECT_GT(figures[name], 0) << name;
    EXPECT_EQ(bench.bounds.size(), 7u);
    EXPECT_EQ(bench.migration.workers().size(), 3u);
    const std::string csv = figures_of(bench).tables.at("speed_up.csv");
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 3);
}

TEST(BenchWorkers, OnThisMachineRunsOfProcessesHaveAWallClockAndACriticalPath) {
    WorkersBenchOptions options;
    options.bodies = {9};
    options.workers = {1, 64};  // more than there are cores: left out
    options.steps = 10;
    options.rounds = 2;
    options.program = MUSICWORLD_PROGRAM;
    options.only = {"threads", "processes"};
    std::map<std::string, double> figures =
        figures_by_name(bench_workers(options, [](const std::string&) {}));
    for (const std::string name : {"processes_bodies9_alone", "processes_bodies9_workers1_bounded",
                                   "processes_bodies9_workers1_barrier"})
        for (const char* what : {"_elapsed", "_critical_path", "_speed_up", "_critical_path_speed_up"})
            EXPECT_GT(figures[name + what], 0) << name << what;
    EXPECT_EQ(figures.at("threads_bodies9_threads1_speed_up"), 1);
    EXPECT_EQ(figures.at("processes_bodies9_alone_critical_path_speed_up"), 1);
}

}  // namespace
}  // namespace app
