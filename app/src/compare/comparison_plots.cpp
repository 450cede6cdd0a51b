#include "compare/comparison_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <set>

#include "compare/tuning.h"
#include "report/plot_panel.h"

namespace app {
namespace {

constexpr int kWide = 1040, kHalf = 520;

using Points = std::vector<std::pair<double, double>>;

/// Lines "x y" of the points within [from, to].
std::string text_of(const Points& points, double from, double to, double scale) {
    std::string text;
    for (const auto& [x, y] : points)
        if (x >= from && x <= to) fmt::format_to(std::back_inserter(text), "{:.5f} {:.5f}\n", x, scale * y);
    return text;
}

/// Recorded and predicted heights within [from_s, to_s]; a path is drawn if `name_of` it is not empty.
PlotWithLegend heights(const StickFigure& figure, double from_s, double to_s, int width,
                       const std::function<std::string(const FigurePath&)>& name_of) {
    constexpr double kMmPerM = 1e3;
    PlotWithLegend plot;
    PlotPanel panel;
    plot.legend.push_back({"recorded", colours::contact, false});
    panel.add(text_of(figure.recorded_m, from_s, to_s, kMmPerM),
              "with lines lt 1 lw 2.2 lc " + gnuplot_colour(colours::contact));
    for (const FigurePath& path : figure.paths) {
        const std::string name = name_of(path);
        if (name.empty()) continue;
        plot.legend.push_back(line_of(plot.legend.size() - 1, name));
        panel.add(text_of(path.height_m, from_s, to_s, kMmPerM), style_of(plot.legend.back(), 1.4));
    }
    double low = 1e9, high = -1e9;
    for (const auto& [t, y] : figure.recorded_m)
        low = std::min(low, kMmPerM * y), high = std::max(high, kMmPerM * y);
    const double room = 0.25 * (high - low) + 1;  // overshoot beyond this leaves the plot
    plot.script = {width, 280,
                   plot_axes() + round_tics("x", to_s - from_s, width == kWide ? 12 : 6) +
                       round_tics("y", high - low + 2 * room, 6) +
                       fmt::format("set xrange [{}:{}]\nset yrange [{}:{}]\nset xlabel 'time, s'\nset ylabel "
                                   "'height, mm'\n",
                                   from_s, to_s, low - room, high + room) +
                       panel.text()};
    return plot;
}

/// The family of a predictor as shown: of cv:q=1e7 and of cv* it is cv.
std::string shown_family(const std::string& name) {
    return family_of(name.substr(0, name.find('*')));
}

/// What a curve plot leaves out: as named, where the family is also there tuned.
bool superseded(const std::string& name, const std::set<std::string>& tuned) {
    return !name.ends_with('*') && name != "naive" && tuned.contains(family_of(name));
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
    for (double decade = std::pow(10, std::floor(std::log10(low))); decade <= high; decade *= 10)
        for (const double tic : {1 * decade, 2 * decade, 5 * decade})
            if (tic >= low && tic <= high) tics += fmt::format("{}{}", tics.empty() ? "" : ",", tic);
    return "set xtics (" + tics + ")\nset mxtics 1\n";
}

}  // namespace

PlotWithLegend height_plot(const StickFigure& figure) {
    std::set<std::string> seen;
    return heights(figure, figure.from_s, figure.to_s, kWide, [&](const FigurePath& path) {
        const bool first = seen.insert(path.predictor).second;  // the first lead alone
        return first ? fmt::format("{}, {:.0f} ms ahead", path.predictor, 1e3 * path.lead_s) : "";
    });
}

PlotWithLegend zoomed_plot(const StickFigure& figure, const std::string& predictor) {
    return heights(figure, figure.zoom_from_s, figure.zoom_to_s, kHalf, [&](const FigurePath& path) {
        return path.predictor == predictor ? fmt::format("{:.0f} ms ahead", 1e3 * path.lead_s) : "";
    });
}

PlotWithLegend curves_plot(const Comparison& comparison) {
    std::set<std::string> tuned;
    for (const LeadCurve& curve : comparison.curves)
        if (curve.predictor.ends_with('*')) tuned.insert(shown_family(curve.predictor));
    PlotWithLegend plot;
    PlotPanel panel;
    double highest = 1;
    for (const LeadCurve& curve : comparison.curves) {
        if (superseded(curve.predictor, tuned) || curve.predictor.ends_with("**")) continue;
        plot.legend.push_back(line_of(plot.legend.size(), curve.predictor));
        Points points;
        for (const auto& [lead_s, rms_mm] : curve.rms_mm) points.emplace_back(1e3 * lead_s, rms_mm);
        panel.add(text_of(points, 0, 150, 1), style_of(plot.legend.back(), 1.6));
        // What runs away (a quadratic) does not set the scale.
        if (is_baseline(curve.predictor) && !curve.rms_mm.empty() &&
            family_of(curve.predictor) != "least-squares")
            highest = std::max(highest, curve.rms_mm.back().second);
    }
    std::string commands = plot_axes() + round_tics("y", 1.25 * highest, 6);
    commands += fmt::format(
        "set xrange [0:150]\nset yrange [0:{}]\nset xtics 10\nset xlabel 'lead, ms'\nset ylabel 'RMS error, "
        "mm'\n",
        1.25 * highest);
    plot.script = {kWide, 360, commands + panel.text()};
    return plot;
}

PlotWithLegend cost_plot(const Comparison& comparison, double lead_s) {
    PlotWithLegend plot;
    PlotPanel panel;
    double fastest = 1e9, slowest = 1, least = 1e9, most = 0;
    for (const ComparisonSummary& s : comparison.summaries) {
        if (s.lead_s != lead_s || !(s.ns_per_sample > 0) || s.predictor.ends_with("**")) continue;
        const bool tuned = s.predictor.ends_with('*');
        const PlotLine look = line_of(family_number(comparison, shown_family(s.predictor)), s.predictor);
        panel.add(fmt::format("{:.3f} {:.4f}\n", s.ns_per_sample, s.error.position.rms()),
                  fmt::format("with points pt {} ps 0.8 lw 1.5 lc {}",
                              (look.dashed ? 4 : 6) + (tuned ? 1 : 0), gnuplot_colour(look.colour)));
        if (!tuned) plot.legend.push_back(look);
        fastest = std::min(fastest, s.ns_per_sample), slowest = std::max(slowest, s.ns_per_sample);
        least = std::min(least, s.error.position.rms()), most = std::max(most, s.error.position.rms());
    }
    const double room = 0.12 * (most - least) + 0.5;
    plot.script = {
        kHalf, 320,
        plot_axes() + round_tics("y", most - least + 2 * room, 6) +
            logarithmic_tics(fastest / 1.5, slowest * 1.5) +
            fmt::format("set logscale x\nset xrange [{}:{}]\nset yrange [{}:{}]\nset xlabel 'cost, ns a "
                        "sample'\nset ylabel 'RMS error, mm'\n",
                        fastest / 1.5, slowest * 1.5, std::max(0.0, least - room), most + room) +
            panel.text()};
    return plot;
}

PlotWithLegend timing_plot(const ComparisonSummary& summary) {
    constexpr int kHalfMs = 30;
    std::map<int, int> bins;
    if (summary.hits)
        for (const double error_ms : summary.hits->errors_ms) ++bins[static_cast<int>(std::floor(error_ms))];
    std::string data;
    int highest = 1;
    for (const auto& [bin, count] : bins) {
        fmt::format_to(std::back_inserter(data), "{} {}\n", bin + 0.5, count);
        highest = std::max(highest, count);
    }
    PlotPanel panel;
    panel.add(data, "with boxes fs solid 0.75 noborder lc " + gnuplot_colour(colours::released));
    PlotWithLegend plot;
    plot.script = {
        kHalf, 220,
        plot_axes() +
            fmt::format(
                "set xrange [{}:{}]\nset yrange [0:{}]\nset xtics 5\nset ytics {}\nset boxwidth 0.9\n"
                "set xlabel 'committed - true time, ms (positive: late)'\nset ylabel 'strikes in 1 ms'\n",
                -kHalfMs, kHalfMs, highest * 1.08, std::max(1.0, round_step(highest, 4))) +
            panel.text()};
    return plot;
}

}  // namespace app
