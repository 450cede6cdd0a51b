
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <set>
#include <tuple>
#include <vector>

#include "compare/comparison.h"
#include "compare/comparison_tables.h"
#include "compare/entrants.h"
#include "report/html.h"
#include "report/plot.h"
#include "traces/sensor_model.h"

namespace app {
namespace {

constexpr int kWide = 1040, kHalf = 520;
constexpr const char* kTitle = "Predictors compared";

using Points = std::vector<std::pair<double, double>>;

/// Lines "x y" of the points within [from, to].
std::string text_of(const Points& points, double from, double to, double scale) {
    std::string text;
    for (const auto& [x, y] : points)
        if (x >= from && x <= to) fmt::format_to(std::back_inserter(text), "{:.5f} {:.5f}\n", x, scale * y);
    return text;
}

/// Recorded and predicted heights within [from_s, to_s]; a path is drawn if `name_of` it is not empty.
PlotScript heights(const StickFigure& figure, double from_s, double to_s, int width,
                   const std::function<std::string(const FigurePath&)>& name_of) {
    constexpr double kMmPerM = 1e3;
    std::vector<PlotLine> legend = {{"recorded", colours::contact}};
    PlotPanel panel;
    panel.add(text_of(figure.recorded_m, from_s, to_s, kMmPerM),
              "with lines lt 1 lw 2.2 lc " + gnuplot_colour(colours::contact));
    for (const FigurePath& path : figure.paths) {
        const std::string name = name_of(path);
        if (name.empty()) continue;
        legend.push_back(line_of(legend.size() - 1, name));
        panel.add(text_of(path.height_m, from_s, to_s, kMmPerM), style_of(legend.back(), 1.4));
    }
    double low = 1e9, high = -1e9;
    for (const auto& [t, y] : figure.recorded_m)
        low = std::min(low, kMmPerM * y), high = std::max(high, kMmPerM * y);
    const double room = 0.25 * (high - low) + 1;  // overshoot beyond this leaves the plot
    return plot_of(width, 280, {"time, s", from_s, to_s, width == kWide ? 12 : 6},
                   {"height, mm", low - room, high + room, 6}, panel, {}, legend);
}

/// The family of a predictor as shown: of cv:q=1e7 and of cv* it is cv.
std::string shown_family(const std::string& name) {
    return family_of(name.substr(0, name.find('*')));
}

/// The place of a family among those that take part: its colour in every plot of costs.
std::size_t family_number(const Comparison& comparison, const std::string& family) {
    std::vector<std::string> families;
    for (const auto& [name, description] : comparison.predictors) {
        const std::string own = shown_family(name);
        if (std::ranges::find(families, own) == families.end()) families.push_back(own);
    }
    return static_cast<std::size_t>(std::ranges::find(families, family) - families.begin());
}

/// 1, 2 and 5 times the powers of ten within a range.
std::string logarithmic_tics(double low, double high) {
    std::string tics;
    for (int exponent = static_cast<int>(std::floor(std::log10(low))); std::pow(10, exponent) <= high;
         ++exponent)
        for (const int digit : {1, 2, 5})
            if (const double tic = digit * std::pow(10, exponent); tic >= low && tic <= high)
                tics += fmt::format("{}{}", tics.empty() ? "" : ",", tic);
    return "set xtics (" + tics + ")\nset mxtics 1\n";
}

/// Figure 3-1: recorded height and predictions at the shortest lead, 3 s.
PlotScript height_plot(const StickFigure& figure) {
    std::set<std::string> seen;
    return heights(figure, figure.from_s, figure.to_s, kWide, [&](const FigurePath& path) {
        const bool first = seen.insert(path.predictor).second;  // the first lead alone
        return first ? fmt::format("{}, {:.0f} ms ahead", path.predictor, 1e3 * path.lead_s) : "";
    });
}

/// Figures 3-2 and 3-3: recorded height and one predictor's at every lead, 0.6 s.
PlotScript zoomed_plot(const StickFigure& figure, const std::string& predictor) {
    return heights(figure, figure.zoom_from_s, figure.zoom_to_s, kHalf, [&](const FigurePath& path) {
        return path.predictor == predictor ? fmt::format("{:.0f} ms ahead", 1e3 * path.lead_s) : "";
    });
}

/// RMS over lead, 0 to 150 ms. Of a family the tuned curve alone, where there is one; naive of 1992 stays.
PlotScript curves_plot(const Comparison& comparison) {
    std::set<std::string> tuned;
    for (const LeadCurve& curve : comparison.curves)
        if (curve.predictor.ends_with('*')) tuned.insert(shown_family(curve.predictor));
    std::vector<PlotLine> legend;
    PlotPanel panel;
    double highest = 1;
    for (const LeadCurve& curve : comparison.curves) {
        const std::string& name = curve.predictor;
        const bool also_tuned = !name.ends_with('*') && tuned.contains(family_of(name));
        if ((also_tuned && name != "naive") || name.ends_with("**")) continue;
        legend.push_back(line_of(legend.size(), name));
        Points points;
        for (const auto& [lead_s, rms_mm] : curve.rms_mm) points.emplace_back(1e3 * lead_s, rms_mm);
        panel.add(text_of(points, 0, 150, 1), style_of(legend.back(), 1.6));
        // What runs away (a quadratic) does not set the scale.
        if (is_baseline(name) && !curve.rms_mm.empty() && family_of(name) != "least-squares")
            highest = std::max(highest, curve.rms_mm.back().second);
    }
    return plot_of(kWide, 360, {"lead, ms", 0, 150}, {"RMS error, mm", 0, 1.25 * highest, 6}, panel,
                   "set xtics 10\n", legend);
}

/// RMS over lead of those that tell how far, up to about three times what hurts.
PlotScript how_far_plot(const Comparison& comparison) {
    constexpr double kHighestMm = 60;
    std::vector<PlotLine> legend;
    PlotPanel panel;
    for (const double limit_mm : {10.0, 20.0})
        panel.add(fmt::format("0 {0}\n150 {0}\n", limit_mm),
                  "with lines lt 1 lw 1 dt '-' lc " + gnuplot_colour(colours::wrong));
    for (const LeadCurve& curve : comparison.curves) {
        if (!tells_how_far(curve.predictor)) continue;
        legend.push_back(line_of(legend.size(), curve.predictor));
        Points points;
        for (const auto& [lead_s, rms_mm] : curve.rms_mm) points.emplace_back(1e3 * lead_s, rms_mm);
        panel.add(text_of(points, 0, 150, 1), style_of(legend.back(), 2));
    }
    return plot_of(kHalf, 320, {"lead, ms", 0, 150}, {"RMS error, mm", 0, kHighestMm, 6}, panel,
                   "set xtics 25\n", legend);
}

/// F1 of their strikes over lead.
PlotScript how_far_strikes_plot(const Comparison& comparison) {
    std::vector<PlotLine> legend;
    PlotPanel panel;
    for (const LeadCurve& curve : comparison.curves) {
        if (curve.hits.empty()) continue;
        legend.push_back(line_of(legend.size(), curve.predictor));
        Points points;
        for (const auto& [lead_s, hits] : curve.hits)
            if (const double f1 = hits.f1(); f1 == f1) points.emplace_back(1e3 * lead_s, f1);
        panel.add(text_of(points, 0, 150, 1), style_of(legend.back(), 2));
    }
    return plot_of(kHalf, 320, {"lead, ms", 0, 150}, {"F1 of strikes", 0, 1, 5}, panel, "set xtics 25\n",
                   legend);
}

/// Empty where none of them takes part.
std::string how_far_content(const Comparison& c, PlotGallery& plots) {
    const Table table = how_far_table(c);
    if (table.rows.empty()) return {};
    std::string figures = plots.element(how_far_plot(c), "How far ahead: error against lead");
    if (std::ranges::any_of(c.curves, [](const LeadCurve& curve) { return !curve.hits.empty(); }))
        figures += plots.element(how_far_strikes_plot(c), "How far ahead: strikes against lead");
    return plots.pair(figures) + table.html();
}

/// Cost of a sample against RMS at a lead: an open point a predictor as named, a filled one as tuned; a
/// colour a family, and a square where its legend is dashed.
PlotScript cost_plot(const Comparison& comparison, double lead_s) {
    std::vector<PlotLine> legend;
    PlotPanel panel;
    double fastest = 1e9, slowest = 1, least = 1e9, most = 0;
    for (const ComparisonSummary& s : comparison.summaries) {
        if (s.lead_s != lead_s || !(s.ns_per_sample > 0) || s.predictor.ends_with("**")) continue;
        const bool tuned = s.predictor.ends_with('*');
        const PlotLine look = line_of(family_number(comparison, shown_family(s.predictor)), s.predictor);
        panel.add(fmt::format("{:.3f} {:.4f}\n", s.ns_per_sample, s.error.position.rms()),
                  fmt::format("with points pt {} ps 0.8 lw 1.5 lc {}",
                              (look.dashed ? 4 : 6) + (tuned ? 1 : 0), gnuplot_colour(look.colour)));
        if (!tuned) legend.push_back(look);
        fastest = std::min(fastest, s.ns_per_sample), slowest = std::max(slowest, s.ns_per_sample);
        least = std::min(least, s.error.position.rms()), most = std::max(most, s.error.position.rms());
    }
    const double room = 0.12 * (most - least) + 0.5;
    return plot_of(kHalf, 320, {"cost, ns a sample", fastest / 1.5, slowest * 1.5},
                   {"RMS error, mm", std::max(0.0, least - room), most + room}, panel,
                   "set logscale x\n" + logarithmic_tics(fastest / 1.5, slowest * 1.5) +
                       round_tics("y", most - least + 2 * room, 6),
                   legend);
}

/// Committed minus true time of the matched strikes of one predictor at a lead.
PlotScript timing_plot(const ComparisonSummary& summary) {
    constexpr int kHalfMs = 30;
    const auto [data, highest] = histogram(summary.hits->errors_ms, 1);
    PlotPanel panel;
    panel.add(data, boxes_of(colours::released));
    return plot_of(
        kHalf, 220, {"committed - true time, ms (positive: late)", -kHalfMs, kHalfMs},
        {"strikes in 1 ms", 0, highest * 1.08}, panel,
        fmt::format("set xtics 5\nset ytics {}\nset boxwidth 0.9\n", std::max(1.0, round_step(highest, 4))));
}

std::string heading(const Comparison& c) {
    std::vector<double> leads_ms;
    for (const double lead_s : c.options.leads_s) leads_ms.push_back(1e3 * lead_s);
    const std::string sensor = describe(c.options.sensor);
    std::string text =
        report_header(kTitle, "by MusicWorld",
                      {{"recordings", fmt::format("{}", c.options.traces.size())},
                       {"persons", fmt::format("{}: {}", c.persons.size(), fmt::join(c.persons, ", "))},
                       {"sensor", sensor.empty() ? "the recordings as they are" : sensor},
                       {"leads", fmt::format("{:.1f} ms", fmt::join(leads_ms, ", "))},
                       {"tuning", c.tuned_on},
                       {"strikes on", c.options.surface_text}});
    text += "<h2>Which predictor wins</h2>\n";
    for (const std::string& sentence : winners(c)) text += fmt::format("<p>{}</p>\n", html(sentence));
    text += fmt::format("<p class=note>{}</p>\n", html(selection_caution(c)));
    return text +
           "<p class=note>Samples are taken at uniform times by linear interpolation, with noise; truth "
           "likewise at t + lead from the noiseless recording. The first 0.5 s and gaps are left out. "
           "Intervals are by bootstrap over recordings or persons; n is their number. NAME* runs the "
           "parameters that erred least on other recordings, NAME** on recordings of other persons.</p>\n";
}

/// The predictors whose strikes are shown as histograms: of each lead the best F1, then auto, thesis and
/// naive.
std::vector<const ComparisonSummary*> shown_strikes(const Comparison& comparison) {
    std::vector<const ComparisonSummary*> shown;
    for (const double lead_s : comparison.options.leads_s) {
        const std::vector<const ComparisonSummary*> ranked = ranked_by_f1(comparison, lead_s);
        if (ranked.empty()) continue;
        shown.push_back(ranked.front());
        for (const ComparisonSummary& s : comparison.summaries)
            if (s.lead_s == lead_s && s.hits && s.hits->matched > 0 && &s != ranked.front() &&
                (s.predictor == "auto" || s.predictor == "thesis" || s.predictor == "naive"))
                shown.push_back(&s);
    }
    return shown;
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
    std::map<Sensor, std::map<double, PairedResult>> rows;  // by noise [mm]
    for (const MapCell& cell : best_cells(comparison.map))
        if (cell.result.lead_s == lead_s)
            rows[{cell.rate_hz, cell.jitter_ms, cell.drop_out}][cell.noise_mm] = cell.result;
    if (rows.empty()) return {};
    std::string text = fmt::format("<p>{}</p>\n<div class=scroll><table class=grid><tr><th>sensor",
                                   html(map_sentence(comparison, lead_s)));
    for (const auto& [noise_mm, result] : rows.begin()->second)
        text += fmt::format("<th>noise {:g} mm", noise_mm);
    text += "</tr>\n";
    for (const auto& [sensor, cells] : rows) {
        const auto& [rate_hz, jitter_ms, lost] = sensor;
        text += fmt::format("<tr><td>{:g} Hz{}{}", rate_hz,
                            jitter_ms > 0 ? fmt::format(", jitter {:g} ms", jitter_ms) : "",
                            lost > 0 ? fmt::format(", {:g} % lost", 100 * lost) : "");
        for (const auto& [noise_mm, result] : cells) text += cell_of(result);
        text += "</tr>\n";
    }
    return text + "</table></div>\n";
}

std::string strike_note(const Comparison& c) {
    return fmt::format(
        "On {}. A strike's time is fixed at the lead; it may be cancelled until {:g} ms before its onset. "
        "Notes and true contacts are matched one to one within 30 ms; errors are those of the matched ones. "
        "Not cancelling: false strikes a minute if all that was fixed is played. Advance: what contacts are "
        "taken to come earlier than predicted, learned on the recordings that tune (least to most over the "
        "recordings). Tuned parameters are those of the least position error, not of the best strikes.",
        html(c.options.surface_text), 1e3 * kReleaseMarginS);
}

std::string map_section(const Comparison& c) {
    const std::string grids = map_grids(c);
    if (grids.empty()) return {};
    return grids + "<details><summary>All sensors with errors in mm</summary>\n" + map_table(c).html() +
           "</details>\n";
}

std::string sections(const Comparison& c, PlotGallery& plots) {
    std::vector<std::string> names;
    for (const FigurePath& path : c.figure.paths)
        if (std::ranges::find(names, path.predictor) == names.end()) names.push_back(path.predictor);
    std::string zoomed;
    for (const std::string& name : names)
        zoomed += plots.element(zoomed_plot(c.figure, name),
                                fmt::format("Figure {}: {}", name == "naive" ? "3-3" : "3-2", name));
    std::string text =
        section("How far ahead before it hurts?",
                html(how_far_sentence(c)) +
                    " RMS of the tracked point over all recordings; the red lines are 10 and 20 "
                    "mm. Strikes, where there is a surface, without an advance.",
                how_far_content(c, plots));
    text += section(
        "A stick and its predictions",
        fmt::format("{}, stick {}. Each predicted point stands at the time that it was predicted for.",
                    html(c.figure.trace), html(c.figure.stick)),
        plots.element(height_plot(c.figure), "Figure 3-1: height as recorded and as predicted") +
            plots.pair(zoomed));
    text += section("Error against lead",
                    "All recordings together. Tuned parameters are those of the nearest lead asked for.",
                    plots.element(curves_plot(c), "RMS error against lead"));
    text += section("Errors",
                    "Of the tracked point but where tip is said; free of impacts: truth not within 50 ms of "
                    "impacts or flagged times.",
                    by_lead(c, error_table));
    text += section("Against the best baseline",
                    "Ratio of the RMS errors, below 1 is better; where the interval includes 1 there is no "
                    "measurable gain.",
                    by_lead(c, paired_table));
    if (std::ranges::any_of(c.summaries, [](const auto& s) { return s.ns_per_sample > 0; })) {
        std::string costs;
        for (const double lead_s : c.options.leads_s)
            costs += plots.element(cost_plot(c, lead_s), fmt::format("{:.1f} ms ahead", 1e3 * lead_s));
        text +=
            section("Speed against error",
                    "Update and predictions at all leads, one core; the figure that differs between runs. "
                    "Open points: as named; filled: tuned. Families whose legend is dashed are squares.",
                    plots.pair(costs));
    }
    std::string timings;
    for (const ComparisonSummary* s : shown_strikes(c))
        timings += plots.element(
            timing_plot(*s), fmt::format("{}, {:.1f} ms ahead: {} of {} true strikes matched", s->predictor,
                                         1e3 * s->lead_s, s->hits->matched, s->hits->true_contacts));
    text += section("Strikes", strike_note(c),
                    by_lead(c, strike_table) + (timings.empty() ? "" : plots.pair(timings)));
    text += section("Calibration",
                    "Share of position errors inside the regions that a predictor states, and the mean "
                    "negative log likelihood (nats, metres).",
                    by_lead(c, calibration_table));
    text += section(
        "Where filters pay",
        "Estimators and baselines tuned alike for each sensor, on other recordings; position only, "
        "true time stamps. A cell: the estimator that errs least there and by how much less than the "
        "best baseline, with the interval by recording (of the gain in RMS error), which holds at 95 % "
        "for all estimators of a cell at once.",
        map_section(c));
    return text + section("Predictors", "Parameters in mm and s.", predictor_table(c).html());
}

}  // namespace

std::string map_grids(const Comparison& comparison) {
    std::string text;
    for (const double lead_s : comparison.options.leads_s) text += grid(comparison, lead_s);
    return text;
}

std::string format_comparison_report(const Comparison& comparison, Plotter& plotter,
                                     const std::filesystem::path& figures) {
    PlotGallery plots;
    const std::string body = heading(comparison) + plots.symbols() + sections(comparison, plots);
    plots.write_files(figures, plotter);
    return report_page(kTitle, plots.drawn(body, plotter));
}

}  // namespace app
