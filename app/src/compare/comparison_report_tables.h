#pragma once
#include <string>

#include "compare/comparison.h"

namespace app {

// Tables of compare's report.html.

/// Errors and cost of every predictor at a lead.
[[nodiscard]] std::string error_table(const Comparison& comparison, double lead_s);
/// Strikes at a lead; empty where none were scored.
[[nodiscard]] std::string strike_table(const Comparison& comparison, double lead_s);
/// Coverage and likelihood of the covariances stated; empty where none are.
[[nodiscard]] std::string calibration_table(const Comparison& comparison, double lead_s);
/// Every estimator against the best baseline at a lead.
[[nodiscard]] std::string paired_table(const Comparison& comparison, double lead_s);
/// Each sensor and lead: the best estimator against the best baseline. Empty without a map.
[[nodiscard]] std::string map_table(const Comparison& comparison);
/// Each predictor: what it is and which parameters ran.
[[nodiscard]] std::string predictor_table(const Comparison& comparison);

}  // namespace app
