// The timeline of the report: tip heights with the marks of strikes and contacts, and the sound under them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include "kit/tip_track.h"
#include "play/play_plots.h"
#include "report/plot_panel.h"
#include "statistics/statistics.h"
#include "strikes/score_strikes.h"

namespace app {
namespace {

constexpr int kTimelineWidth = 1040, kColumns = 980;  // of the drawing, of the panels
constexpr int kHeightPanel = 170, kSoundPanel = 56, kFrame = 34;
constexpr std::size_t kMostRows = 12;
constexpr double kGap_s = 0.25;  // a line is not drawn across a longer gap in the data

/// The heights that most of the paths keep to (a glitch of the tracker may not flatten them), and all
/// contacts.
std::pair<double, double> height_range(const PlayResult& result) {
    std::vector<double> heights;
    for (const TipTrack& track : result.tracks)
        for (const Eigen::Vector3d& tip : track.tip) heights.push_back(tip.y());
    if (heights.empty()) heights = {0};
    double low = quantile(heights, 0.001), high = quantile(heights, 0.999);
    for (const TrueContact& contact : result.contacts) {
        low = std::min(low, contact.point_world.y());
        high = std::max(high, contact.point_world.y());
    }
    const double border = std::max(0.06 * (high - low), 0.01);
    return {low - border, high + border};
}

/// The samples of one column of pixels as "x y" lines: all of a few, the first, lowest, highest and last of
/// many.
void write_column(std::string& text, const TipTrack& track, std::size_t begin, std::size_t end) {
    std::vector<std::size_t> kept;
    if (end - begin <= 4) {
        for (std::size_t i = begin; i < end; ++i) kept.push_back(i);
    } else {
        const auto lower = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return a.y() < b.y(); };
        const auto tip = [&](std::size_t i) { return track.tip.begin() + static_cast<std::ptrdiff_t>(i); };
        const auto [low, high] = std::minmax_element(tip(begin), tip(end), lower);
        kept = {begin, static_cast<std::size_t>(low - track.tip.begin()),
                static_cast<std::size_t>(high - track.tip.begin()), end - 1};
        std::sort(kept.begin(), kept.end());
        kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
    }
    for (const std::size_t i : kept) {
        if (i > 0 && track.t_s[i] - track.t_s[i - 1] > kGap_s) text += '\n';
        fmt::format_to(std::back_inserter(text), "{:.4f} {:.4f}\n", track.t_s[i], track.tip[i].y());
    }
}

/// A path within [from_s, to_s] and one sample beyond on either side.
std::string height_line(const TipTrack& track, double from_s, double to_s) {
    const auto index_of = [&](auto found) { return static_cast<std::size_t>(found - track.t_s.begin()); };
    std::size_t begin = index_of(std::lower_bound(track.t_s.begin(), track.t_s.end(), from_s));
    std::size_t end = index_of(std::upper_bound(track.t_s.begin(), track.t_s.end(), to_s));
    if (begin > 0) --begin;
    if (end < track.t_s.size()) ++end;
    const double column_s = (to_s - from_s) / kColumns;
    std::string text;
    while (begin < end) {
        const double column_end_s = (std::floor(track.t_s[begin] / column_s) + 1) * column_s;
        std::size_t next = begin + 1;
        while (next < end && track.t_s[next] < column_end_s) ++next;
        write_column(text, track, begin, next);
        begin = next;
    }
    return text;
}

struct MarkStyle {
    const ReportColour& colour;
    Mark mark;
    int point_type;
    double size;
};

/// In the order of drawing; gnuplot's point types: 2 cross, 4 frame, 6 ring, 7 disc, 11 triangle pointing
/// down.
constexpr MarkStyle kMarkStyles[] = {{colours::cancelled, Mark::cancelled, 2, 0.85},
                                     {colours::contact, Mark::contact, 6, 0.95},
                                     {colours::released, Mark::released, 7, 0.55},
                                     {colours::missed, Mark::missed, 4, 1.0},
                                     {colours::wrong, Mark::wrong, 11, 0.8}};

std::string mark_points(const PlayResult& result, const std::vector<Mark>& kinds, Mark wanted,
                        const PlotArea& area) {
    ThinnedMarks points(area);
    for (const TrueContact& contact : result.contacts) {
        const bool shown = wanted == Mark::contact || (wanted == Mark::missed && contact.matched_id == 0);
        if (shown) points.add(contact.t_s, contact.point_world.y());
    }
    for (std::size_t i = 0; i < kinds.size(); ++i)
        if (kinds[i] == wanted) points.add(result.strikes[i].onset_s, result.strikes[i].point_world.y());
    return points.text();
}

std::string height_panel(const PlayResult& result, const std::vector<Mark>& kinds, const PlotArea& area) {
    PlotPanel panel;
    for (std::size_t i = 0; i < result.tracks.size(); ++i)
        panel.add(height_line(result.tracks[i], area.x_low, area.x_high),
                  "with lines lw 1.4 lc " + gnuplot_colour(stick_colour(i)));
    for (const MarkStyle& style : kMarkStyles)
        panel.add(mark_points(result, kinds, style.mark, area),
                  fmt::format("with points lw 1.6 pt {} ps {} lc {}", style.point_type, style.size,
                              gnuplot_colour(style.colour)));
    return fmt::format("set yrange [{}:{}]\n{}set ylabel 'tip height, m' offset 1\n", area.y_low, area.y_high,
                       round_tics("y", area.y_high - area.y_low, 4)) +
           panel.text();
}

std::string sound_panel(const PlayResult& result, const std::vector<Mark>& kinds, const PlotArea& area,
                        double peak) {
    PlotPanel panel;
    panel.add(sound_envelope(result.audio, result.t0_s, area.x_low, area.x_high, kColumns),
              "with filledcurves fs solid 1 noborder lc " + gnuplot_colour(colours::wave));
    const PlotArea strip = {area.x_low, area.x_high, -peak, peak, kColumns, 1};
    for (const auto& [kind, colour] :
         {std::pair{Mark::released, colours::released}, {Mark::wrong, colours::wrong}}) {
        ThinnedMarks onsets(strip);
        for (std::size_t i = 0; i < kinds.size(); ++i)
            if (kinds[i] == kind)
                onsets.add(result.strikes[i].onset_s, -peak, fmt::format("0 {:.4f}", 2 * peak));
        panel.add(onsets.text(), "with vectors nohead lw 0.8 lc " + gnuplot_colour(colour));
    }
    return fmt::format("set yrange [{}:{}]\nset ytics ({} 0)\nset ylabel 'sound' offset 1\n", -peak, peak,
                       gnuplot_string("0")) +
           panel.text();
}

PlotScript row_plot(const PlayResult& result, const std::vector<Mark>& kinds, const PlotArea& area,
                    double peak) {
    const bool sound = !result.audio.empty();
    const int height = kHeightPanel + kFrame + (sound ? kSoundPanel : 0);
    const auto margins = [&](int top, int bottom) {
        return fmt::format("set tmargin at screen {}\nset bmargin at screen {}\n",
                           1 - static_cast<double>(top) / height, 1 - static_cast<double>(bottom) / height);
    };
    std::string commands = plot_axes();
    commands += fmt::format("set xrange [{}:{}]\n", area.x_low, area.x_high);
    commands += "set multiplot\nset lmargin at screen 0.058\nset rmargin at screen 0.984\n";
    const std::string time_axis = round_tics("x", area.x_high - area.x_low, 8);
    commands += margins(8, kHeightPanel) + time_axis;
    if (sound) {
        commands += "set format x ''\n" + height_panel(result, kinds, area);
        commands += margins(kHeightPanel + 6, kHeightPanel + kSoundPanel) + time_axis + "set format y '%g'\n";
        commands += sound_panel(result, kinds, area, peak);
    } else {
        commands += height_panel(result, kinds, area);
    }
    return {kTimelineWidth, height, commands + "unset multiplot\n"};
}

}  // namespace

Timeline timeline_of(const PlayResult& result) {
    const double duration_s = std::max(result.t_end_s - result.t0_s, 1e-3);
    Timeline timeline;
    timeline.row_s = std::min(timeline.row_s, duration_s);
    const auto rows = static_cast<std::size_t>(std::ceil(duration_s / timeline.row_s - 1e-9));
    std::vector<int> errors(rows);
    const auto count = [&](double t_s) {
        const double row = std::floor((t_s - result.t0_s) / timeline.row_s);
        ++errors[std::min(static_cast<std::size_t>(std::max(row, 0.0)), rows - 1)];
    };
    const std::vector<Mark> marks = strike_marks(result);
    for (std::size_t i = 0; i < marks.size(); ++i)
        if (marks[i] == Mark::wrong) count(result.strikes[i].onset_s);
    for (const TrueContact& contact : result.contacts)
        if (contact.matched_id == 0) count(contact.t_s);
    std::vector<std::size_t> shown(rows);
    std::iota(shown.begin(), shown.end(), 0);
    timeline.whole = rows <= kMostRows;
    if (!timeline.whole) {
        std::stable_sort(shown.begin(), shown.end(), [&](auto a, auto b) { return errors[a] > errors[b]; });
        shown.resize(kMostRows);
        std::sort(shown.begin(), shown.end());
    }
    for (const std::size_t row : shown)
        timeline.starts_s.push_back(result.t0_s + static_cast<double>(row) * timeline.row_s);
    return timeline;
}

std::vector<PlotScript> timeline_plots(const PlayResult& result, const Timeline& timeline) {
    const auto [low, high] = height_range(result);
    const std::vector<Mark> kinds = strike_marks(result);
    double peak = 1e-3;
    for (const float sample : result.audio) peak = std::max(peak, std::abs(static_cast<double>(sample)));
    std::vector<PlotScript> scripts;
    for (const double from_s : timeline.starts_s)
        scripts.push_back(row_plot(
            result, kinds, {from_s, from_s + timeline.row_s, low, high, kColumns, kHeightPanel}, peak));
    return scripts;
}

}  // namespace app
