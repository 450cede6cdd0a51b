#pragma once
#include <sim/distributed_world.h>

#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "bench/bench_report.h"
#include "simulate/run_measures.h"

namespace app {

struct WorkersBenchOptions {
    std::vector<int> bodies = {25, 400};
    std::vector<int> workers = {1, 2, 3, 5, 10};
    int steps = 500;
    int bound = 4;                        ///< of speed-ups
    sim::SimulatedProcessors processors;  ///< the clock
    std::set<std::string> only;           ///< of workers_bench_parts(); empty: all
    std::string program;                  ///< musicworld, for worker processes
};

/// speedup, stragglers, bound, migration, processes, throughput.
[[nodiscard]] std::vector<std::string> workers_bench_parts();

/// Elapsed times of one number of bodies [s], by number of workers.
struct SpeedUp {
    struct Row {
        int workers = 1;
        double async_s = 0, lockstep_s = 0;
        double ceiling_s =
            0;  ///< of the slowest of as many worlds that share the bodies, but no contact or message
        double bytes = 0;  ///< a body's step, asynchronously
    };
    int bodies = 0;
    double alone_s = 0;  ///< one processor
    std::vector<Row> rows;
};

/// One row of the table of B against speed and error.
struct BoundRow {
    int bound = 0;  ///< 0: lockstep
    double elapsed_s = 0;
    double elapsed_unsteady_s = 0;  ///< with every step slow (2x) with probability 0.2
    double momentum_drift = 0;      ///< share of the largest sum of |m v|
    double apart_m = 0;             ///< rms distance of centres from lockstep's after a second
    double height = 0;              ///< mean at the end over lockstep's
    int ghost_age = 0;              ///< largest [steps]
};

struct WorkersBench {
    BenchReport report;
    std::vector<SpeedUp> speed_ups;
    std::vector<BoundRow> bounds;
    WorkerHistory migration;
};

[[nodiscard]] WorkersBench bench_workers(const WorkersBenchOptions& options,
                                         const std::function<void(const std::string&)>& progress);

/// Elapsed time and speed-up over workers (figures 2-4 and 2-5 of the thesis).
[[nodiscard]] PlotScript speed_up_plot(const SpeedUp& speed_up);
[[nodiscard]] std::string speed_up_csv(const std::vector<SpeedUp>& speed_ups);
[[nodiscard]] std::string bound_csv(const std::vector<BoundRow>& rows);
/// Tables beside the report's figures.
[[nodiscard]] std::string format_text(const WorkersBench& bench);

}  // namespace app
