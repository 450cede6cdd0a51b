#pragma once
#include <sim/distributed_world.h>
#include <sim/world.h>

#include <optional>
#include <set>
#include <string>
#include <vector>

namespace app {

class Command;

/// What `bench` measures, and the parts of `bench workers`.
inline const std::vector<std::string> kBenchNames = {"tracking", "sim",   "workers",
                                                     "render",   "audio", "tradeoff"},
                                      kWorkersBenchParts = {"speedup",   "stragglers", "bound",
                                                            "migration", "processes",  "throughput"};

struct SimBenchOptions {
    std::vector<int> bodies = {25, 100, 400, 1600};
    int modes = 12;
    int rounds = 0;  ///< of all steps; 0: five for 25 bodies, three for 100, one for more
    int steps = 500;
    /// Bodies of one kind in a box of planes instead of the piles.
    struct Scene {
        std::string name;
        sim::WorldDefinition world;
    };
    std::optional<Scene> scene = std::nullopt;
};

struct WorkersBenchOptions {
    std::vector<int> bodies = {25, 400};
    std::vector<int> workers = {1, 2, 3, 5, 10};
    int steps = 500;
    int bound = 4;                        ///< of speed-ups
    sim::SimulatedProcessors processors;  ///< the clock
    std::set<std::string> only;           ///< of kWorkersBenchParts; empty: all
    std::string program;                  ///< musicworld, for worker processes
};

struct BenchOptions {
    std::string name;  ///< of kBenchNames, or "all"
    std::string out, scene;
    SimBenchOptions sim;
    WorkersBenchOptions workers;
    bool json = false;
};

/// The options of `bench`, which musicworld checks and tells, and musicworld_bench carries out.
void add_bench_options(Command& command, BenchOptions& options);

}  // namespace app
