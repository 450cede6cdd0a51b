#pragma once
#include <sim/distributed_world.h>

#include <functional>
#include <string>
#include <vector>

#include "bench/bench_report.h"
#include "commands/bench_options.h"
#include "simulate/run_measures.h"

namespace app {

/// A distributed run and what was seen of it.
struct MeasuredRun {
    struct Trade {
        std::uint64_t step;
        int bodies, from, to;
    };
    sim::DistributedResult result;
    std::vector<sim::WorkerStep> steps;  ///< as told
    std::vector<Trade> trades;
    WorkerHistory history;
    std::vector<Eigen::Vector3d> after_a_second;  ///< centres
    double mean_height = 0;                       ///< of centres at the end [m]
    double momentum_drift = 0;                    ///< share of the largest sum of |m v|
    std::uint64_t body_steps = 0;

    /// What the same steps would take if none began before all before it had ended: the sum over steps of the
    /// longest [s]. Meaningful while no bodies are traded.
    [[nodiscard]] double with_barrier_s() const;
};

[[nodiscard]] MeasuredRun measure_run(const sim::WorldScene& scene, const sim::DistributedSettings& settings,
                                      const sim::SimulatedProcessors& processors);
[[nodiscard]] MeasuredRun measure_run(const sim::WorldScene& scene, const sim::DistributedSettings& settings,
                                      const sim::DistributedLaunch& launch);

/// A world of its own of every `of`-th part of the bodies in order of x, with walls where the others' bodies
/// begin: what a worker could do if there were no others.
[[nodiscard]] sim::WorldDefinition strip_of(const sim::WorldDefinition& world, int number, int of);

/// How uneven the workers are when the slowest has done `step` steps: the largest distance of a smoothed step
/// time from their average, in units of what is allowed: 15 % of it, or what one body takes if that is more.
[[nodiscard]] double unevenness_at(const MeasuredRun& run, std::uint64_t step);
/// The most trades within `window` steps from a step on.
[[nodiscard]] int most_trades(const MeasuredRun& run, std::uint64_t from, std::uint64_t to,
                              std::uint64_t window);

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

/// The report's, with tables and plots of what was measured: elapsed time and speed-up over workers (figures 2-4
/// and 2-5 of the thesis), bounds, migration.
[[nodiscard]] Figures figures_of(const WorkersBench& bench);

}  // namespace app
