#pragma once
#include <string>
#include <utility>
#include <vector>

#include "comparison.h"
#include "gnuplot.h"
#include "report_svg.h"

namespace app {

/// A line of a plot, for its legend.
struct PlotLine {
    std::string name;
    ReportColour colour;
    bool dashed = false;
};

/// A plot with its legend.
struct ComparisonPlot {
    PlotScript script;
    std::vector<PlotLine> legend;
};

/// Figure 3-1: recorded height and predictions at the shortest lead, 3 s.
[[nodiscard]] ComparisonPlot height_plot(const StickFigure& figure);
/// Figures 3-2 and 3-3: recorded height and one predictor's at every lead, 0.6 s.
[[nodiscard]] ComparisonPlot zoomed_plot(const StickFigure& figure, const std::string& predictor);
/// RMS over lead, 0 to 150 ms. Of a family the tuned curve alone, where there is one; naive of 1992 stays.
[[nodiscard]] ComparisonPlot curves_plot(const Comparison& comparison);
/// Cost of a sample against RMS at a lead: an open point a predictor as named, a filled one as tuned; a
/// colour a family, and a square where its legend is dashed.
[[nodiscard]] ComparisonPlot cost_plot(const Comparison& comparison, double lead_s);
/// Committed minus true time of the matched strikes of one predictor at a lead.
[[nodiscard]] ComparisonPlot timing_plot(const ComparisonSummary& summary);

}  // namespace app
