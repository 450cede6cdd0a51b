#pragma once
#include <filesystem>
#include <string>

#include "compare/comparison.h"

namespace app {

/// Text of compare's report.html: which predictor wins, figures 3-1 to 3-3 of the thesis redone, error
/// against lead and cost, strikes, calibration, paired differences, the map. One page that needs nothing
/// beside it, in the style of play's report. Plots are drawn by gnuplot with temporary files in `scratch`.
[[nodiscard]] std::string format_comparison_report(const Comparison& comparison,
                                                   const std::filesystem::path& scratch);

/// The map on one screen: a sentence a lead (in how many sensors which estimator gains), then a table a lead,
/// sensors down (rate, jitter, drop-outs), noise across; a cell names the best estimator and its gain over
/// the best baseline with the 95 % interval. Empty without a map.
[[nodiscard]] std::string map_grids(const Comparison& comparison);

}  // namespace app
