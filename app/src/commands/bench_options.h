#pragma once
#include <sim/world.h>
#include <simulated_processors.h>

#include <optional>
#include <set>
#include <string>
#include <vector>

namespace app {

class Command;

/// What `bench` measures, the parts of `bench workers` and the scenes of `bench hard`.
inline const std::vector<std::string> kBenchNames = {"tracking", "sim",   "hard",    "workers",
                                                     "render",   "audio", "tradeoff"},
                                      kWorkersBenchParts = {"speedup",   "stragglers", "bound",
                                                            "migration", "threads",    "processes"},
                                      kHardSceneNames = {
                                          "table",        "ghost",   "card_through_wall", "boxes_1cm",
                                          "stack10_10cm", "stack15", "ratio1000",         "modal_ball_rolls",
                                          "beads",        "chain20", "double_pendulum",   "top"};

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
    std::vector<int> bodies = {};  ///< none: 25 and 400; threads, processes: 400 and 1600
    std::vector<int> workers = {1, 2, 3, 5, 10};
    int steps = 500;
    int bound = 4;                              ///< of speed-ups
    int rounds = 3;                             ///< of threads and processes
    sim_bench::SimulatedProcessors processors;  ///< the clock
    std::set<std::string> only;                 ///< of kWorkersBenchParts; empty: all
    std::string program;                        ///< musicworld, for worker processes
};

struct HardBenchOptions {
    std::vector<std::string> scenes;  ///< of kHardSceneNames; none: all
    int halvings = 4;                 ///< of the scene's step, at most
    double longest_s = 20;            ///< of processor time: after a longer run the step is not halved again
};

struct BenchOptions {
    std::string name;  ///< of kBenchNames, or "all"
    std::string out, scene;
    SimBenchOptions sim;
    HardBenchOptions hard;
    WorkersBenchOptions workers;
    bool json = false;
};

/// The options of `bench`, which musicworld checks and tells, and musicworld_bench carries out.
void add_bench_options(Command& command, BenchOptions& options);

}  // namespace app
