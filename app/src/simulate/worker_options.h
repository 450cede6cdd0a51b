#pragma once
#include <sim/distributed_world.h>

#include <filesystem>
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

/// "sync" or "async".
[[nodiscard]] inline std::string mode_name(sim::Pace pace) {
    return pace == sim::Pace::lockstep ? "sync" : "async";
}

}  // namespace app
