#pragma once
#include <sim/distributed_world.h>

#include <functional>
#include <string>
#include <vector>

#include "bench/bench_report.h"
#include "commands/bench_options.h"
#include "simulate/run_measures.h"

namespace app {

// What lies in sim/bench measures; here is which of it is measured, and its report.

/// Times of one number of bodies on simulated processors [s], by number of workers; their caches warm.
struct SpeedUp {
    struct Run {
        double elapsed_s = 0;
        double cold_caches = 1;  ///< see sim::DistributedResult; the elapsed time leaves it out
        double busiest_s =
            0;  ///< of the worker with most to do: the elapsed time if nobody waited; 0: unknown
    };
    struct Row {
        int workers = 1;
        Run bounded, barrier;  ///< with the bound that was asked for, with a bound of 0
        double bytes = 0;      ///< a body's step, of the bounded run
    };
    int bodies = 0;
    double alone_s = 0;  ///< one processor
    std::vector<Row> rows;
};

/// One row of the table of B against speed and error.
struct BoundRow {
    int bound = 0;
    double elapsed_s = 0;
    double elapsed_unsteady_s = 0;  ///< with every step slow (2x) with probability 0.2
    double momentum_drift = 0;      ///< share of the largest sum of |m v|
    double apart_m = 0;             ///< rms distance of centres from one process's after a second
    double height = 0;              ///< mean at the end over one process's
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

/// The report's, with tables and plots of what was measured: elapsed time and speed-up over workers (figures 2-4
/// and 2-5 of the thesis), bounds, migration.
[[nodiscard]] Figures figures_of(const WorkersBench& bench);

}  // namespace app
