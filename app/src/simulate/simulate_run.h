#pragma once
#include "simulate/simulate.h"

namespace app {

/// What is known before the first step.
[[nodiscard]] SimulateResult result_at_start(const SimulateOptions& options, const Scene& scene);
/// How many steps at most.
[[nodiscard]] std::uint64_t last_step(const SimulateOptions& options, const Scene& scene);
/// Bodies and their state at the end.
void describe_end(const sim::World& world, SimulateResult& result);

/// The run on options.workers: processes or simulated processors.
[[nodiscard]] SimulateResult simulate_with_workers(const SimulateOptions& options, const Scene& scene);

}  // namespace app
