#pragma once
#include <string>

#include "compare/comparison.h"

namespace app {

/// Text of compare.json: `settings`, `results` (a row for every recording, stick, predictor and lead),
/// `summary` (the same over all recordings), `paired`, `winners` and, with a map, `map`. Figures that do not
/// exist (no orientation, no surface, no stated covariance, no cost measured) are null. Numbers read back to
/// the same double.
[[nodiscard]] std::string format_comparison_json(const Comparison& comparison);

/// Text of compare.csv: `results` flat, a column a figure, empty where there is none.
[[nodiscard]] std::string format_comparison_csv(const Comparison& comparison);

/// What the command prints: the figures over all recordings, aligned, in mm; paired differences; winners.
[[nodiscard]] std::string format_comparison_text(const Comparison& comparison);

}  // namespace app
