#pragma once
#include <string>

#include "compare/comparison.h"
#include "report/table.h"

namespace app {

// Figures that do not exist (no orientation, no surface, no stated covariance, no cost measured, a ratio of
// nothing) are none in every table.

/// compare.csv and `results` of compare.json: by recording, stick, predictor and lead.
[[nodiscard]] Table result_table(const Comparison& comparison);

// Tables for readers, over all recordings; without rows where there is nothing to show.

/// Errors and cost of every predictor at a lead.
[[nodiscard]] Table error_table(const Comparison& comparison, double lead_s);
/// Strikes at a lead.
[[nodiscard]] Table strike_table(const Comparison& comparison, double lead_s);
/// Coverage and likelihood of the covariances stated.
[[nodiscard]] Table calibration_table(const Comparison& comparison, double lead_s);
/// Every estimator against the best baseline at a lead.
[[nodiscard]] Table paired_table(const Comparison& comparison, double lead_s);
/// Each sensor and lead: the best estimator against the best baseline.
[[nodiscard]] Table map_table(const Comparison& comparison);
/// Each predictor: what it is and which parameters ran.
[[nodiscard]] Table predictor_table(const Comparison& comparison);

/// Text of compare.json: `settings`, `results`, `summary` (the same over all recordings), `paired`, `winners`
/// and, with a map, `map`. Numbers read back to the same double.
[[nodiscard]] std::string format_comparison_json(const Comparison& comparison);

/// What the command prints: the tables for readers at each lead, the map, the winners.
[[nodiscard]] std::string format_comparison_text(const Comparison& comparison);

}  // namespace app
