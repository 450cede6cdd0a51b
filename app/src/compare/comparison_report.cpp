#include "compare/comparison_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <vector>

#include "compare/comparison_map.h"
#include "compare/comparison_plots.h"
#include "compare/comparison_tables.h"
#include "compare/findings.h"
#include "report/html.h"
#include "traces/sensor_model.h"

namespace app {
namespace {

std::string leads_text(const std::vector<double>& leads_s) {
    std::string text;
    for (const double lead_s : leads_s)
        text += fmt::format("{}{:.1f}", text.empty() ? "" : ", ", 1e3 * lead_s);
    return text + " ms";
}

std::string heading(const Comparison& c) {
    std::string persons;
    for (const std::string& person : c.persons) persons += (persons.empty() ? "" : ", ") + person;
    std::string text = "<header><h1>Predictors compared</h1>\n<p>by MusicWorld</p>\n<dl class=facts>\n";
    text += report_fact("recordings", fmt::format("{}", c.options.traces.size()));
    text += report_fact("persons", fmt::format("{}: {}", c.persons.size(), persons));
    const std::string sensor = describe(c.options.sensor);
    text += report_fact("sensor", sensor.empty() ? "the recordings as they are" : sensor);
    text += report_fact("leads", leads_text(c.options.leads_s));
    text += report_fact("tuning", c.tuned_on);
    text += report_fact("strikes on", c.options.surface_text);
    text += "</dl></header>\n<h2>Which predictor wins</h2>\n";
    for (const std::string& sentence : winners(c)) text += fmt::format("<p>{}</p>\n", html(sentence));
    text += fmt::format("<p class=note>{}</p>\n", html(selection_caution(c)));
    return text +
           "<p class=note>Samples are taken at uniform times by linear interpolation, with noise; truth "
           "likewise "
           "at t + lead from the noiseless recording. The first 0.5 s and gaps are left out. Intervals are "
           "95 %, by "
           "bootstrap over recordings or persons; n is their number. NAME* runs the parameters that erred "
           "least "
           "on other recordings, NAME** on recordings of other persons. The best baseline is chosen on the "
           "scored "
           "recordings themselves, which favours it.</p>\n";
}

/// The predictors whose strikes are shown as histograms: of each lead the best F1, then auto, thesis and
/// naive.
std::vector<const ComparisonSummary*> shown_strikes(const Comparison& comparison) {
    std::vector<const ComparisonSummary*> shown;
    for (const double lead_s : comparison.options.leads_s) {
        const ComparisonSummary* best = nullptr;
        for (const ComparisonSummary& s : comparison.summaries)
            if (s.lead_s == lead_s && s.hits && s.hits->true_contacts > 0 &&
                (best == nullptr || s.hits->f1() > best->hits->f1()))
                best = &s;
        if (best != nullptr) shown.push_back(best);
        for (const ComparisonSummary& s : comparison.summaries)
            if (s.lead_s == lead_s && s.hits && s.hits->matched > 0 && &s != best &&
                (s.predictor == "auto" || s.predictor == "thesis" || s.predictor == "naive"))
                shown.push_back(&s);
    }
    return shown;
}

struct Placed {
    std::size_t height = 0, curves = 0;
    std::vector<std::size_t> zoomed, costs, timings;
};

Placed declare(PlotGallery& plots, const Comparison& comparison) {
    Placed placed;
    const StickFigure& figure = comparison.figure;
    placed.height = plots.add(height_plot(figure), "Figure 3-1: height as recorded and as predicted");
    std::vector<std::string> names;
    for (const FigurePath& path : figure.paths)
        if (std::find(names.begin(), names.end(), path.predictor) == names.end())
            names.push_back(path.predictor);
    for (const std::string& name : names)
        placed.zoomed.push_back(plots.add(
            zoomed_plot(figure, name), fmt::format("Figure {}: {}", name == "naive" ? "3-3" : "3-2", name)));
    placed.curves = plots.add(curves_plot(comparison), "RMS error against lead");
    const bool timed = std::any_of(comparison.summaries.begin(), comparison.summaries.end(),
                                   [](const ComparisonSummary& s) { return s.ns_per_sample > 0; });
    for (std::size_t i = 0; timed && i < comparison.options.leads_s.size(); ++i)
        placed.costs.push_back(
            plots.add(cost_plot(comparison, comparison.options.leads_s[i]),
                      fmt::format("{:.1f} ms ahead", 1e3 * comparison.options.leads_s[i])));
    for (const ComparisonSummary* s : shown_strikes(comparison))
        placed.timings.push_back(plots.add(
            timing_plot(*s), fmt::format("{}, {:.1f} ms ahead: {} of {} true strikes matched", s->predictor,
                                         1e3 * s->lead_s, s->hits->matched, s->hits->true_contacts)));
    return placed;
}

std::string section(std::string_view title, std::string_view note, const std::string& content) {
    if (content.empty()) return {};
    return fmt::format("<h2>{}</h2>\n<p class=note>{}</p>\n{}", title, note, content);
}

/// A table a lead.
std::string by_lead(const Comparison& c, Table (*table)(const Comparison&, double)) {
    std::string text;
    for (const double lead_s : c.options.leads_s)
        if (const std::string rows = table(c, lead_s).html(); !rows.empty())
            text += fmt::format("<h3>{:.1f} ms ahead</h3>\n{}", 1e3 * lead_s, rows);
    return text;
}

using Sensor = std::tuple<double, double, double>;  // rate [Hz], jitter [ms], share lost

/// The best estimators of one lead by sensor and noise [mm].
std::map<Sensor, std::map<double, const MapCell*>> rows_of(const Comparison& comparison, double lead_s) {
    std::map<Sensor, std::map<double, const MapCell*>> rows;
    for (const MapCell* cell : best_cells(comparison.map))
        if (cell->result.lead_s == lead_s)
            rows[{cell->rate_hz, cell->jitter_ms, cell->drop_out}][cell->noise_mm] = cell;
    return rows;
}

/// The gain in % of the RMS error and its interval.
std::string cell_of(const PairedResult& result) {
    const PairedDifference& d = result.by_recording;
    const std::string name = html(result.predictor), gain = fmt::format("{:.1f} %", gain_percent(d.ratio));
    if (std::isinf(d.ratio)) return "<td class=none>the baseline errs nothing";
    if (!d.has_interval()) return fmt::format("<td>{} {}", name, gain);
    const std::string range = fmt::format("({:.1f} to {:.1f})", gain_percent(d.high), gain_percent(d.low));
    if (d.gain()) return fmt::format("<td class=gain>{} <b>{}</b> {}", name, gain, range);
    return fmt::format("<td class=none>{} {}", d.loss() ? "loss" : "no measurable gain", range);
}

std::string grid(const Comparison& comparison, double lead_s) {
    const auto rows = rows_of(comparison, lead_s);
    if (rows.empty()) return {};
    std::string text = fmt::format("<p>{}</p>\n<div class=scroll><table class=grid><tr><th>sensor",
                                   html(map_sentence(comparison, lead_s)));
    for (const auto& [noise_mm, cell] : rows.begin()->second)
        text += fmt::format("<th>noise {:g} mm", noise_mm);
    text += "</tr>\n";
    for (const auto& [sensor, cells] : rows) {
        const auto& [rate_hz, jitter_ms, lost] = sensor;
        text += fmt::format("<tr><td>{:g} Hz{}{}", rate_hz,
                            jitter_ms > 0 ? fmt::format(", jitter {:g} ms", jitter_ms) : "",
                            lost > 0 ? fmt::format(", {:g} % lost", 100 * lost) : "");
        for (const auto& [noise_mm, cell] : cells) text += cell_of(cell->result);
        text += "</tr>\n";
    }
    return text + "</table></div>\n";
}

std::string strike_note(const Comparison& c) {
    return fmt::format(
        "On {}. A strike's time is fixed at the lead; it may be cancelled until {:g} ms before its onset. "
        "Notes "
        "and true contacts are matched one to one within 30 ms; errors are those of the matched ones. Not "
        "cancelling: false strikes a minute if all that was fixed is played. Advance: what contacts are "
        "taken to "
        "come earlier than predicted, learned on the recordings that tune (least to most over the "
        "recordings). "
        "Tuned parameters are those of the least position error, not of the best strikes.",
        html(c.options.surface_text), 1e3 * c.options.release_margin_s);
}

std::string map_section(const Comparison& c) {
    const std::string grids = map_grids(c);
    if (grids.empty()) return {};
    return grids + "<details><summary>All sensors with errors in mm</summary>\n" + map_table(c).html() +
           "</details>\n";
}

std::string sections(const Comparison& c, const PlotGallery& plots, const Placed& placed) {
    std::string text =
        section("A stick and its predictions",
                fmt::format("{}, stick {}. Each predicted point stands at the time that it was "
                            "predicted for.",
                            html(c.figure.trace), html(c.figure.stick)),
                plots.element(placed.height) + plots.pair(placed.zoomed));
    text += section("Error against lead",
                    "All recordings together. Tuned parameters are those of the nearest lead asked for.",
                    plots.element(placed.curves));
    text += section("Errors",
                    "Of the tracked point but where tip is said; free of impacts: truth not within 50 ms of "
                    "impacts or flagged times.",
                    by_lead(c, error_table));
    text += section("Against the best baseline",
                    "Ratio of the RMS errors, below 1 is better; where the interval includes 1 there is no "
                    "measurable gain.",
                    by_lead(c, paired_table));
    if (!placed.costs.empty())
        text += section("Speed against error",
                        "Update and predictions at all leads, one core; the figure that differs between "
                        "runs. Open points: "
                        "as named; filled: tuned. Families whose legend is dashed are squares.",
                        plots.pair(placed.costs));
    text += section("Strikes", strike_note(c),
                    by_lead(c, strike_table) + (placed.timings.empty() ? "" : plots.pair(placed.timings)));
    text += section("Calibration",
                    "Share of position errors inside the regions that a predictor states, and the mean "
                    "negative log likelihood (nats, metres).",
                    by_lead(c, calibration_table));
    text +=
        section("Where filters pay",
                "Estimators and baselines tuned alike for each sensor, on other recordings; position only, "
                "true time stamps. A cell: the estimator that errs least there and by how much less than the "
                "best baseline, with the 95 % interval by recording (of the gain in RMS error). The best is "
                "picked on the scored recordings; the intervals do not correct for that.",
                map_section(c));
    return text + section("Predictors", "Parameters in mm and s.", predictor_table(c).html());
}

}  // namespace

std::string map_grids(const Comparison& comparison) {
    std::string text;
    for (const double lead_s : comparison.options.leads_s) text += grid(comparison, lead_s);
    return text;
}

std::string format_comparison_report(const Comparison& comparison, const std::filesystem::path& scratch) {
    PlotGallery plots;
    const Placed placed = declare(plots, comparison);
    plots.draw(scratch);
    return report_page("Predictors compared",
                       heading(comparison) + plots.symbols() + sections(comparison, plots, placed));
}

}  // namespace app
