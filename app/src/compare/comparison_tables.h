#pragma once
#include <string>
#include <vector>

#include "compare/comparison.h"
#include "report/plot.h"
#include "report/table.h"

namespace app {

// Figures that do not exist (no orientation, no surface, no stated covariance, no cost measured, a ratio of
// nothing) are none in every table.

/// `results` of compare.json: by recording, stick, predictor and lead.
[[nodiscard]] Table result_table(const Comparison& comparison);
/// compare.csv: the same, and with a map a row for each of its cells, which are of no trace.
[[nodiscard]] Table csv_table(const Comparison& comparison);

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
/// The leads at which errors and strikes of those that tell_how_far() become bad [ms].
[[nodiscard]] Table how_far_table(const Comparison& comparison);
/// Each predictor: what it is and which parameters ran.
[[nodiscard]] Table predictor_table(const Comparison& comparison);

/// Text of compare.json: `settings`, `results`, `summary` (the same over all recordings), `paired`, `winners`,
/// where it all comes from and, with a map, `map`. Numbers read back to the same double.
[[nodiscard]] std::string format_comparison_json(const Comparison& comparison);

/// The summaries of a lead with true strikes, the best F1 first.
[[nodiscard]] std::vector<const ComparisonSummary*> ranked_by_f1(const Comparison& comparison, double lead_s);

// What a comparison finds, in sentences.

/// "33.3 ms ahead singer* errs least, ...; of 292 true strikes ca predicts most, ...", a sentence a lead.
[[nodiscard]] std::vector<std::string> winners(const Comparison& comparison);

/// "auto errs by more than 10 mm from 34 ms ahead on, by more than 20 mm from 52 ms on", of each that tells how far.
[[nodiscard]] std::string how_far_sentence(const Comparison& comparison);

/// What the intervals correct for, and what they do not.
[[nodiscard]] std::string selection_caution(const Comparison& comparison);

/// "66.7 ms ahead an estimator gains in 40 of 64 sensors, 3.1 % in the median (cv* 30, singer* 10)", of one
/// lead; empty without a map.
[[nodiscard]] std::string map_sentence(const Comparison& comparison, double lead_s);

/// The saving in % that a ratio of RMS errors is.
[[nodiscard]] inline double gain_percent(double ratio) {
    return 100 * (1 - ratio);
}

/// What the command prints: the tables for readers at each lead, the map, a legend, the winners.
[[nodiscard]] std::string format_comparison_text(const Comparison& comparison);

/// Text of compare's report.html: which predictor wins, figures 3-1 to 3-3 of the thesis redone, error
/// against lead and cost, strikes, calibration, paired differences, the map. One page that needs nothing
/// beside it, in the style of play's report. `figures`: an existing folder that gets each plot as SVG and PNG.
[[nodiscard]] std::string format_comparison_report(const Comparison& comparison, Plotter& plotter,
                                                   const std::filesystem::path& figures);

/// The map on one screen: a sentence a lead (in how many sensors which estimator gains), then a table a lead,
/// sensors down (rate, jitter, drop-outs), noise across; a cell names the best estimator and its gain over
/// the best baseline with the 95 % interval. Empty without a map.
[[nodiscard]] std::string map_grids(const Comparison& comparison);

}  // namespace app
