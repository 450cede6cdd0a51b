#pragma once
#include <sim/distributed_world.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>

namespace app {

/// How a scene is shared out to workers.
struct WorkerOptions {
    int count = 0;  ///< processes started here, or simulated processors
    sim::Pace pace = sim::Pace::lockstep;
    int bound = 0;  ///< [steps]
    bool balance = true;
    std::string listen;  ///< endpoint; empty: in a private folder
    std::filesystem::path keys;
    int expect = 0;                                     ///< workers before the first step
    std::optional<sim::SimulatedProcessors> simulated;  ///< instead of processes
};

/// The options of `simulate` about workers, as typed.
struct WorkerArguments {
    std::string mode = "sync", balance = "on", listen, keys, processors;
    std::optional<int> bound;
    int workers = 0, expect = 0;
};

[[nodiscard]] std::shared_ptr<WorkerArguments> add_worker_options(CLI::App& command);

/// None: in this process. Throws BadInput.
[[nodiscard]] std::optional<WorkerOptions> worker_options_of(const WorkerArguments& arguments);

/// "simulated[:latency=SECONDS,slowdown=TIMES,cost=measured|modelled]". Throws BadInput.
[[nodiscard]] sim::SimulatedProcessors parse_processors(const std::string& text);

/// "sync" or "async".
[[nodiscard]] std::string mode_name(sim::Pace pace);

}  // namespace app
