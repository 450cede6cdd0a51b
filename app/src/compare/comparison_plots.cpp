#include "compare/comparison_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>

#include "compare/tuning.h"
#include "report/plot.h"

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

PlotScript height_script(const StickFigure& figure, double from_s, double to_s, int width,
                         const std::vector<std::pair<PlotLine, const FigurePath*>>& paths) {
    constexpr double kMmPerM = 1e3;
    PlotPanel panel;
    panel.add(text_of(figure.recorded_m, from_s, to_s, kMmPerM),
              "with lines lt 1 lw 2.2 lc " + gnuplot_colour(colours::contact));
    double low = 1e9, high = -1e9;
    for (const auto& [t, y] : figure.recorded_m)
        low = std::min(low, kMmPerM * y), high = std::max(high, kMmPerM * y);
    for (const auto& [line, path] : paths)
        panel.add(text_of(path->height_m, from_s, to_s, kMmPerM), style_of(line, 1.4));
    const double room = 0.25 * (high - low) + 1;  // overshoot beyond this leaves the plot
    std::string commands = plot_axes() + round_tics("x", to_s - from_s, width == kWide ? 12 : 6) +
                           round_tics("y", high - low + 2 * room, 6);
    commands +=
        fmt::format("set xrange [{}:{}]\nset yrange [{}:{}]\nset xlabel 'time, s'\nset ylabel 'height, mm'\n",
                    from_s, to_s, low - room, high + room);
    return {width, 280, commands + panel.text()};
}

/// What a curve plot leaves out: as named, where the family is also there tuned.
bool superseded(const std::string& name, const std::set<std::string>& tuned) {
    return !name.ends_with('*') && name != "naive" && tuned.contains(family_of(name));
}

/// The place of a family among those that take part: its colour in every plot of costs.
std::size_t family_number(const Comparison& comparison, const std::string& family) {
    std::vector<std::string> families;
    for (const auto& [name, description] : comparison.predictors) {
        const std::string own = family_of(name.substr(0, name.find('*')));
        if (std::find(families.begin(), families.end(), own) == families.end()) families.push_back(own);
    }
    return static_cast<std::size_t>(std::find(families.begin(), families.end(), family) - families.begin());
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
    PlotWithLegend plot;
    plot.legend.push_back({"recorded", colours::contact, false});
    std::vector<std::pair<PlotLine, const FigurePath*>> paths;
    std::set<std::string> seen;
    for (const FigurePath& path : figure.paths) {
        if (!seen.insert(path.predictor).second) continue;  // the first lead alone
        paths.emplace_back(
            line_of(paths.size(), fmt::format("{}, {:.0f} ms ahead", path.predictor, 1e3 * path.lead_s)),
            &path);
        plot.legend.push_back(paths.back().first);
    }
    plot.script = height_script(figure, figure.from_s, figure.to_s, kWide, paths);
    return plot;
}

PlotWithLegend zoomed_plot(const StickFigure& figure, const std::string& predictor) {
    PlotWithLegend plot;
    plot.legend.push_back({"recorded", colours::contact, false});
    std::vector<std::pair<PlotLine, const FigurePath*>> paths;
    for (const FigurePath& path : figure.paths) {
        if (path.predictor != predictor) continue;
        paths.emplace_back(line_of(paths.size(), fmt::format("{:.0f} ms ahead", 1e3 * path.lead_s)), &path);
        plot.legend.push_back(paths.back().first);
    }
    plot.script = height_script(figure, figure.zoom_from_s, figure.zoom_to_s, kHalf, paths);
    return plot;
}

PlotWithLegend curves_plot(const Comparison& comparison) {
    std::set<std::string> tuned;
    for (const LeadCurve& curve : comparison.curves)
        if (curve.predictor.ends_with('*'))
            tuned.insert(curve.predictor.substr(0, curve.predictor.find('*')));
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
        const std::size_t n =
            family_number(comparison, family_of(s.predictor.substr(0, s.predictor.find('*'))));
        const PlotLine look = line_of(n, s.predictor);
        panel.add(fmt::format("{:.3f} {:.4f}\n", s.ns_per_sample, s.error.rms_mm),
                  fmt::format("with points pt {} ps 0.8 lw 1.5 lc {}",
                              (look.dashed ? 4 : 6) + (tuned ? 1 : 0), gnuplot_colour(look.colour)));
        if (!tuned) plot.legend.push_back(look);
        fastest = std::min(fastest, s.ns_per_sample), slowest = std::max(slowest, s.ns_per_sample);
        least = std::min(least, s.error.rms_mm), most = std::max(most, s.error.rms_mm);
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
