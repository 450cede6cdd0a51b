#pragma once
#include <optional>

#include "commands/command.h"
#include "simulate/simulate.h"

namespace app {

/// The options of `simulate` about workers; none: in this process. What makes no sense together is refused.
void add_worker_options(Command& command, std::optional<WorkerOptions>& options);

namespace as {

/// "simulated[:latency=SECONDS,slowdown=TIMES,cost=measured|modelled]"; their count is left out.
[[nodiscard]] ValueFormat<sim_bench::SimulatedProcessors> processors();

}  // namespace as
}  // namespace app
