#pragma once
#include <sim/distributed_world.h>

#include <functional>
#include <vector>

namespace sim_bench {

/// Workers in this process. Each has a clock of its own, which advances by the cost of its work once it has
/// the scene. Events happen in the order of simulated time.
struct SimulatedProcessors {
    int count = 1;
    /// From worker to worker, by way of the application: half of it to there, half from there.
    double latency_s = 2e-4;
    double slowdown = 1;  ///< simulated seconds per second of what steps cost, measured or modelled
    bool modelled =
        false;  ///< costs are counted (World::work), not measured: results are a pure function of the input
    double seconds_per_work = 2e-6;  ///< modelled: of one unit of work, times slowdown
    /// Workers that take turns in one thread find their caches cold; on a processor of their own they would
    /// not. So each worker repeats all its work alone afterwards, and SimulatedResult::cold_caches says how
    /// much faster that is. This is measured even if costs are modelled. Every message is kept for it.
    bool repeat_alone = false;
    /// A further factor of a worker's step, such as a straggler's; empty: none.
    std::function<double(int worker, std::uint64_t step)> factor;
    /// Failures at simulated times, for tests.
    struct Failure {
        double time_s;
        int worker;
        enum class Kind { kill, stop, resume, cut, drain, join } kind;
    };
    std::vector<Failure> failures;  ///< in any order
    double silence_s = 1;           ///< a worker that is silent for this long is lost
};

struct SimulatedResult : sim::DistributedResult {
    /// With repeat_alone: the workers' processor time in turns over their processor time alone. As far as
    /// elapsed_s is work, it is too long by this factor.
    double cold_caches = 1;
    double busiest_s =
        0;  ///< with repeat_alone: time of the worker that takes longest alone, by the run's clock
};

/// Throws sim::InputError for a scene or count that is refused.
SimulatedResult simulate_processors(const sim::WorldScene& scene, const sim::DistributedSettings& settings,
                                    const SimulatedProcessors& processors,
                                    sim::DistributedObserver& observer);

}  // namespace sim_bench
