#include "latency/latency_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include "report/plot_panel.h"

namespace app {
namespace {

constexpr int kWide = 1040, kHalf = 520;

std::string axes(const char* x, const char* y) {
    return plot_axes() + fmt::format("set xlabel '{}'\nset ylabel '{}'\n", x, y);
}

std::string range(const char* axis, double low, double high) {
    return fmt::format("set {}range [{}:{}]\n", axis, low, high);
}

/// Lines "x y" of the longest values that 1 in 1, 2, 3, ... exceeds, thinned to about 50 a factor of ten.
std::string longer_shares(const Spread& ms, double least_ms) {
    const std::vector<double>& sorted = ms.sorted();
    const double n = static_cast<double>(sorted.size());
    std::string text;
    double last = 2;
    for (std::size_t i = 0; i < sorted.size(); ++i) {
        const double share = (n - static_cast<double>(i)) / n;
        if (share > last * 0.955 && i + 1 != sorted.size()) continue;
        last = share;
        fmt::format_to(std::back_inserter(text), "{:.6g} {:.6g}\n", std::max(sorted[i], least_ms), share);
    }
    return text;
}

/// Counts in bins of a width, as boxes.
struct Histogram {
    std::string data;
    int highest = 1;
};
Histogram histogram(const Spread& ms, double bin_ms, double low_ms, double high_ms) {
    std::map<int, int> bins;
    for (const double value : ms.sorted())
        if (value >= low_ms && value <= high_ms) ++bins[static_cast<int>(std::floor(value / bin_ms))];
    Histogram made;
    if (bins.empty()) return made;
    for (int bin = bins.begin()->first - 1; bin <= bins.rbegin()->first + 1; ++bin) {
        const auto found = bins.find(bin);
        const int count = found == bins.end() ? 0 : found->second;
        fmt::format_to(std::back_inserter(made.data), "{} {}\n", (bin + 0.5) * bin_ms, count);
        made.highest = std::max(made.highest, count);
    }
    return made;
}

/// A vertical line.
void add_line(PlotPanel& panel, double x, double height, const PlotLine& look) {
    panel.add(fmt::format("{} 0\n{} {}\n", x, x, height), style_of(look, 1.4));
}

/// The shaded place of what drummers call no latency: 10 +- 3 ms after the picture.
std::string drummers_box(double height) {
    return fmt::format("set object 1 rect from {},0 to {},{} fc {} fs solid 0.18 noborder behind\n",
                       kDrummersLatencyMs - kDrummersJitterMs, kDrummersLatencyMs + kDrummersJitterMs, height,
                       gnuplot_colour(colours::sticks[1]));
}

const PlotLine kPicture{"against the drawn path", colours::released},
    kFrame{"against the first frame behind the surface", colours::wave},
    kAtsc{"ATSC production limit (-15, +45 ms)", colours::sticks[2]},
    kItu{"ITU-R BT.1359 detectable (-45, +125 ms)", colours::wrong},
    kDrummers{"drummers: 10 +- 3 ms passes for none", colours::sticks[1]};

std::string boxes(const PlotLine& look) {
    return "with boxes fs solid 0.75 noborder lc " + gnuplot_colour(look.colour);
}

double pixels_ms_after_due(const FrameTiming& frame) {
    return 1e-6 * static_cast<double>(frame.read_ns - frame.shown_ns);
}

double seconds(std::int64_t ns) {
    return 1e-9 * static_cast<double>(ns);
}

}  // namespace

PlotWithLegend stage_plot(const LatencyReport& report, LatencyStage::Kind kind) {
    constexpr double kLeastMs = 1e-5;
    PlotWithLegend plot;
    PlotPanel panel;
    double low = 1e9, high = 1e-3, rarest = 0.1;
    for (const LatencyStage& stage : report.stages) {
        if (stage.kind != kind) continue;
        plot.legend.push_back(line_of(plot.legend.size(), stage.name));
        panel.add(longer_shares(stage.ms, kLeastMs), style_of(plot.legend.back(), 1.6));
        low = std::min(low, std::max(stage.ms.percentile(5), kLeastMs));
        high = std::max(high, stage.ms.max());
        rarest = std::min(rarest, 1 / static_cast<double>(stage.ms.count()));
    }
    plot.script = {kHalf, 320,
                   axes("ms", "share that took longer") + "set logscale xy\nset format '%g'\n" +
                       range("x", std::min(low, high) / 1.5, high * 1.5) + range("y", rarest / 1.5, 1) +
                       panel.text()};
    return plot;
}

PlotWithLegend leads_plot(const RealtimeResult& realtime) {
    struct Series {
        const char* name;
        double LeadStep::*value;
        ReportColour colour;
        bool dashed;
    };
    constexpr Series kSeries[] = {{"lead of pictures", &LeadStep::render_lead_s, colours::sticks[0], false},
                                  {"their delay", &LeadStep::render_delay_s, colours::sticks[0], true},
                                  {"lead of sound", &LeadStep::sound_lead_s, colours::sticks[1], false},
                                  {"its delay", &LeadStep::sound_delay_s, colours::sticks[1], true}};
    PlotWithLegend plot;
    PlotPanel panel;
    double highest = 10;
    for (const Series& series : kSeries) {
        const auto ms = [&](const LeadStep& step) { return 1e3 * step.*series.value; };
        // Delays are measured where leads follow them.
        if (std::all_of(realtime.leads.begin(), realtime.leads.end(),
                        [&](const LeadStep& step) { return ms(step) == 0; }))
            continue;
        std::string data;
        for (const LeadStep& step : realtime.leads) {
            fmt::format_to(std::back_inserter(data), "{:.3f} {:.4f}\n", step.at_s, ms(step));
            highest = std::max(highest, ms(step));
        }
        fmt::format_to(std::back_inserter(data), "{:.3f} {:.4f}\n",
                       std::max(realtime.seconds, realtime.leads.back().at_s), ms(realtime.leads.back()));
        plot.legend.push_back({series.name, series.colour, series.dashed});
        panel.add(data, fmt::format("with steps lt 1 lw 1.6{} lc {}", series.dashed ? " dt '-'" : "",
                                    gnuplot_colour(series.colour)));
    }
    plot.script = {kWide, 260,
                   axes("time, s", "ms") + range("x", 0, std::max(realtime.seconds, 1e-3)) +
                       range("y", 0, highest * 1.1) + round_tics("y", highest * 1.1, 6) + panel.text()};
    return plot;
}

PlotWithLegend sound_picture_plot(const LatencyReport& report) {
    const double low = std::min(-60.0, std::floor(report.sound_minus_picture_ms.min())),
                 high = std::max(140.0, std::ceil(report.sound_minus_picture_ms.max()));
    const Histogram counts = histogram(report.sound_minus_picture_ms, 2, low, high);
    const double top = 1.08 * counts.highest;
    PlotPanel panel;
    panel.add(counts.data, boxes(kPicture));
    for (const double x : {kAtscLimits.early_ms, kAtscLimits.late_ms}) add_line(panel, x, top, kAtsc);
    for (const double x : {kItuLimits.early_ms, kItuLimits.late_ms}) add_line(panel, x, top, kItu);
    return {
        {kHalf, 260,
         axes("sound - picture, ms (positive: sound late)", "strikes in 2 ms") + drummers_box(top) +
             range("x", low, high) + range("y", 0, top) + "set xtics 20\nset boxwidth 1.8\n" + panel.text()},
        {kPicture, kAtsc, kItu, kDrummers}};
}

PlotWithLegend sound_picture_close_plot(const LatencyReport& report) {
    const double middle = std::round(report.sound_minus_picture_ms.percentile(50) / 10) * 10;
    const double low = middle - 40, high = middle + 40;
    const Histogram path = histogram(report.sound_minus_picture_ms, 1, low, high),
                    frame = histogram(report.sound_minus_frame_ms, 1, low, high);
    const double top = 1.08 * std::max(path.highest, frame.highest);
    PlotPanel panel;
    panel.add(path.data, boxes(kPicture));
    panel.add(frame.data, "with histeps lt 1 lw 1.4 lc " + gnuplot_colour(kFrame.colour));
    return {
        {kHalf, 260,
         axes("sound - picture, ms (positive: sound late)", "strikes in 1 ms") + drummers_box(top) +
             range("x", low, high) + range("y", 0, top) + "set xtics 10\nset boxwidth 0.9\n" + panel.text()},
        {kPicture, kFrame, kDrummers}};
}

PlotWithLegend frames_plot(const RealtimeResult& realtime) {
    double low = -5, high = 5, last_s = realtime.seconds;
    for (const FrameTiming& frame : realtime.frames) {
        last_s = std::max(last_s, seconds(frame.shown_ns));
        if (frame.read_ns == 0) continue;
        low = std::min(low, pixels_ms_after_due(frame) - 2);
        high = std::max(high, pixels_ms_after_due(frame) + 2);
    }
    const PlotArea area{0, std::max(last_s, 1e-3), low, high, kWide, 240};
    ThinnedMarks in_time(area), late(area), skipped(area);
    for (const FrameTiming& frame : realtime.frames) {
        const double at_s = seconds(frame.shown_ns);
        if (!frame.asked_for) continue;
        if (frame.fate == FrameFate::skipped)
            skipped.add(at_s, 0);
        else
            (frame.fate == FrameFate::late ? late : in_time).add(at_s, pixels_ms_after_due(frame));
    }
    const PlotLine shown{"in time", colours::released}, missed{"late: not shown", colours::wrong},
        never{"skipped: not drawn", colours::missed};
    PlotPanel panel;
    panel.add(in_time.text(), "with points pt 7 ps 0.25 lc " + gnuplot_colour(shown.colour));
    panel.add(late.text(), "with points pt 7 ps 0.5 lc " + gnuplot_colour(missed.colour));
    panel.add(skipped.text(), "with points pt 7 ps 0.5 lc " + gnuplot_colour(never.colour));
    panel.add(fmt::format("0 0\n{} 0\n", area.x_high),
              "with lines lt 1 lw 1 lc " + gnuplot_colour(colours::axis));
    return {{kWide, 260,
             axes("due on the screen, s", "pixels there after that, ms") + range("x", 0, area.x_high) +
                 range("y", low, high) + round_tics("y", high - low, 6) + panel.text()},
            {shown, missed, never}};
}

PlotWithLegend error_plot(const LatencyReport& report) {
    constexpr double kWindowS = 0.5;
    std::string data;
    double highest = 1;
    const double end_s = report.errors.empty() ? 1 : report.errors.back().at_s;
    for (int window = 0; window * kWindowS < end_s; ++window) {
        const double from_s = window * kWindowS;
        const double rms = rms_mm(report.errors, from_s, from_s + kWindowS);
        fmt::format_to(std::back_inserter(data), "{:.3f} {:.4f}\n", from_s + kWindowS / 2, rms);
        highest = std::max(highest, rms);
    }
    const PlotLine line{"RMS over 0.5 s, all sticks", colours::sticks[0]};
    PlotPanel panel;
    panel.add(data, style_of(line, 1.6));
    return {{kWide, 220,
             axes("time, s", "mm") + range("x", 0, end_s) + range("y", 0, 1.1 * highest) +
                 round_tics("y", 1.1 * highest, 5) + panel.text()},
            {line}};
}

}  // namespace app
