#pragma once
#include <sim/world.h>

#include <vector>

namespace sim_bench {

/// Medians over rounds of what all steps of a world took with so many threads [s].
struct ThreadsSpeed {
    int threads = 1;
    double elapsed_s = 0;  ///< by the wall clock
    double cpu_s = 0;      ///< of all threads
};

/// The same world with each number of threads (World::use_threads), in turns of 25 steps, so that other load
/// meets all alike.
[[nodiscard]] std::vector<ThreadsSpeed> measure_threads(const sim::WorldDefinition& world,
                                                        const std::vector<int>& threads, int steps,
                                                        int rounds);

}  // namespace sim_bench
