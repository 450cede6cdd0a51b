#pragma once
#include <string>

#include "compare/comparison.h"
#include "report/plot.h"

namespace app {

/// Figure 3-1: recorded height and predictions at the shortest lead, 3 s.
[[nodiscard]] PlotWithLegend height_plot(const StickFigure& figure);
/// Figures 3-2 and 3-3: recorded height and one predictor's at every lead, 0.6 s.
[[nodiscard]] PlotWithLegend zoomed_plot(const StickFigure& figure, const std::string& predictor);
/// RMS over lead, 0 to 150 ms. Of a family the tuned curve alone, where there is one; naive of 1992 stays.
[[nodiscard]] PlotWithLegend curves_plot(const Comparison& comparison);
/// Cost of a sample against RMS at a lead: an open point a predictor as named, a filled one as tuned; a
/// colour a family, and a square where its legend is dashed.
[[nodiscard]] PlotWithLegend cost_plot(const Comparison& comparison, double lead_s);
/// Committed minus true time of the matched strikes of one predictor at a lead.
[[nodiscard]] PlotWithLegend timing_plot(const ComparisonSummary& summary);

}  // namespace app
