#pragma once
#include "sim/simulation.h"

namespace sim {

inline constexpr double kTimeLimit_s = 1e8;

/// Throws std::invalid_argument (what was found, what was expected) unless every number is finite and in
/// range, every body exists and every path's times increase. Simulations and decoders call it, so nothing
/// behind it meets a NaN.
void check_request(const StepRequest& request, std::size_t bodies);

}  // namespace sim
