#pragma once
#include <sim/distributed_world.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "simulated_processors.h"

namespace sim_bench {

/// A distributed run with its observed steps and trades.
struct SharedRun {
    struct Trade {
        std::uint64_t step;
        int bodies, from, to;
    };
    SimulatedResult result;  ///< without simulated processors, cold_caches and busiest_s are not set
    std::vector<sim::WorkerStep> steps;  ///< as reported
    std::vector<Trade> trades;
    std::vector<Eigen::Vector3d> after_a_second;  ///< centres
    double mean_height = 0;                       ///< of centres at the end [m]
    std::uint64_t body_steps = 0;

    /// What the same steps would take by processor time, messages included, if each worker had a processor of
    /// its own and began step s when all had ended step s - 1 - lead [s]. 0: a barrier after each step, so
    /// the sum of the longest.
    [[nodiscard]] double critical_path_s(int lead = 0) const;
};

/// `also` gets all calls, too.
[[nodiscard]] SharedRun measure_run(const sim::WorldScene& scene, const sim::DistributedSettings& settings,
                                    const SimulatedProcessors& processors,
                                    sim::DistributedObserver* also = nullptr);
[[nodiscard]] SharedRun measure_run(const sim::WorldScene& scene, const sim::DistributedSettings& settings,
                                    const sim::DistributedLaunch& launch);
/// In this process, without workers, by one thread.
[[nodiscard]] SharedRun measure_alone(const sim::WorldScene& scene, const sim::DistributedSettings& settings);

/// How uneven the workers are when the slowest has done `step` steps: the largest distance of a smoothed step
/// time from their average, in units of what is allowed: 15 % of it, or what one body takes if that is more.
[[nodiscard]] double unevenness_at(const SharedRun& run, std::uint64_t step);
/// The most trades within `window` steps from a step on.
[[nodiscard]] int most_trades(const SharedRun& run, std::uint64_t from, std::uint64_t to,
                              std::uint64_t window);
/// Root mean square distance of centres after a second [m].
[[nodiscard]] double apart(const SharedRun& a, const SharedRun& b);

/// Every step of every worker twice as long with probability 0.2, the same in every run.
[[nodiscard]] double unsteady(int worker, std::uint64_t step);
/// One of the workers at a time takes twice as long, for 20 steps: a factor for each worker and step.
[[nodiscard]] double wandering(int workers, int worker, std::uint64_t step);

}  // namespace sim_bench
