#include "play/play_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>
#include <unordered_map>

#include "kit/tip_track.h"
#include "report/plot_panel.h"
#include "statistics/statistics.h"
#include "strikes/score_strikes.h"

namespace app {
namespace {

constexpr int kWidth = 1040;

/// The range of the timing plots, [-half_ms, half_ms], and their bins: as wide as the errors ask for.
struct ErrorScale {
    double half_ms = 30, bin_ms = 1;
    int tic_ms = 5;
};

ErrorScale error_scale(const std::vector<MatchedNote>& notes) {
    double largest_ms = 0;
    for (const MatchedNote& note : notes) largest_ms = std::max(largest_ms, std::abs(note.error_ms));
    if (largest_ms < 5) return {5, 0.25, 1};
    if (largest_ms < 10) return {10, 0.5, 2};
    return {30, 1, 5};
}

std::string zero_line() {
    return fmt::format("set arrow 1 from 0, graph 0 to 0, graph 1 nohead lt 1 lw 1 dt '-' lc {}\n",
                       gnuplot_colour(colours::axis));
}

/// The strikes of one kind, those with the longest lead first.
std::vector<const Strike*> strikes_by_lead(const PlayResult& result, Mark wanted) {
    const std::vector<Mark> kinds = strike_marks(result);
    std::vector<const Strike*> chosen;
    for (std::size_t i = 0; i < kinds.size(); ++i)
        if (kinds[i] == wanted) chosen.push_back(&result.strikes[i]);
    std::stable_sort(chosen.begin(), chosen.end(), [](const Strike* a, const Strike* b) {
        return a->onset_s - a->scheduled_at_s > b->onset_s - b->scheduled_at_s;
    });
    return chosen;
}

std::string level_line(int number, double y) {
    return fmt::format(
        "set arrow {0} from graph 0, first {1} to graph 1, first {1} nohead lt 1 lw 1 dt '-' lc {2}\n",
        number, y, gnuplot_colour(colours::axis));
}

constexpr int kColumns = 980;  // of the timeline's panels
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
    return {kWidth, height, commands + "unset multiplot\n"};
}

}  // namespace

std::vector<Mark> strike_marks(const PlayResult& result) {
    std::unordered_map<std::uint64_t, bool> matched;
    for (const TrueContact& contact : result.contacts) matched[contact.matched_id] = true;
    std::vector<Mark> marks;
    for (const Strike& strike : result.strikes) {
        const Mark heard = matched.count(strike.id) > 0 ? Mark::released : Mark::wrong;
        marks.push_back(strike.outcome == Outcome::released ? heard : Mark::cancelled);
    }
    return marks;
}

std::vector<MatchedNote> matched_notes(const PlayResult& result) {
    std::unordered_map<std::uint64_t, const Strike*> by_id;
    for (const Strike& strike : result.strikes) by_id.emplace(strike.id, &strike);
    std::vector<MatchedNote> notes;
    for (const TrueContact& contact : result.contacts)
        if (const auto strike = by_id.find(contact.matched_id); strike != by_id.end())
            notes.push_back(
                {(strike->second->onset_s - contact.t_s) * 1e3, contact.stick, contact.instrument});
    return notes;
}

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

PlotScript timing_plot(const PlayResult& result) {
    const std::vector<MatchedNote> notes = matched_notes(result);
    const ErrorScale scale = error_scale(notes);
    std::map<int, int> bins;
    for (const MatchedNote& note : notes) ++bins[static_cast<int>(std::floor(note.error_ms / scale.bin_ms))];
    std::string data;
    int highest = 1;
    for (const auto& [bin, count] : bins) {
        fmt::format_to(std::back_inserter(data), "{} {}\n", (bin + 0.5) * scale.bin_ms, count);
        highest = std::max(highest, count);
    }
    PlotPanel panel;
    panel.add(data, "with boxes fs solid 0.75 noborder lc " + gnuplot_colour(colours::released));
    std::string commands = plot_axes() + zero_line();
    commands += fmt::format(
        "set xrange [{}:{}]\nset yrange [0:{}]\nset ytics {}\nset xtics {}\nset boxwidth {}\n"
        "set xlabel 'onset - true contact, ms (positive: sound late)'\nset ylabel 'notes in {} ms'\n",
        -scale.half_ms, scale.half_ms, highest * 1.08, std::max(1.0, round_step(highest, 5)), scale.tic_ms,
        0.9 * scale.bin_ms, scale.bin_ms);
    return {kWidth / 2, 260, commands + panel.text()};
}

PlotScript timing_by_instrument_plot(const PlayResult& result) {
    const std::vector<MatchedNote> notes = matched_notes(result);
    std::map<std::uint32_t, int> lines;  // instrument -> line, those with notes only
    for (const MatchedNote& note : notes) lines.emplace(note.instrument, 0);
    std::string tics;
    int count = 0;
    for (auto line = lines.rbegin(); line != lines.rend(); ++line) {
        line->second = count;
        fmt::format_to(std::back_inserter(tics), "{}{} {}", tics.empty() ? "" : ",",
                       gnuplot_string(result.instruments.at(line->first)), count++);
    }
    const int rows = std::max(count, 1), height = std::max(260, 70 + 24 * rows);
    const ErrorScale scale = error_scale(notes);
    const PlotArea area = {-scale.half_ms, scale.half_ms, -0.6, rows - 0.4, kWidth, height * 2};
    PlotPanel panel;
    const double sticks = std::max<double>(static_cast<double>(result.sticks.size()), 1);
    for (std::uint32_t stick = 0; stick < result.sticks.size(); ++stick) {
        ThinnedMarks marks(area);
        const double lift =
            0.5 * ((stick + 0.5) / sticks - 0.5);  // the sticks of a line lie one above the other
        for (const MatchedNote& note : notes)
            if (note.stick == stick) marks.add(note.error_ms, lines[note.instrument] - lift);
        panel.add(marks.text(), "with points pt 7 ps 0.5 lc " + gnuplot_colour(stick_colour(stick)));
    }
    std::string commands = plot_axes() + zero_line();
    commands += fmt::format(
        "set xrange [{}:{}]\nset yrange [-0.6:{}]\nset xtics {}\nset ytics ({})\n"
        "set xlabel 'onset - true contact, ms (positive: sound late)'\n",
        area.x_low, area.x_high, area.y_high, scale.tic_ms, tics);
    return {kWidth / 2, height, commands + panel.text()};
}

PlotScript lead_plot(const PlayResult& result) {
    const double first_ms = -1e3 * result.sound_lead_s, release_ms = -1e3 * result.release_margin_s;
    double low = std::min({first_ms * 1.1, release_ms * 1.1, -1.0});
    for (const Strike& strike : result.strikes)
        low = std::min(low, (strike.scheduled_at_s - strike.onset_s) * 1.05e3);
    const double count = static_cast<double>(result.strikes.size());
    const PlotArea area = {0.5, std::max(count, 1.0) + 0.5, low, 0, kWidth, 260};
    int place = 0;
    PlotPanel panel;
    for (const auto& [kind, colour] : {std::pair{Mark::released, colours::released},
                                       {Mark::wrong, colours::wrong},
                                       {Mark::cancelled, colours::cancelled}}) {
        ThinnedMarks held(area), first(area), decided(area);
        for (const Strike* strike : strikes_by_lead(result, kind)) {
            const double from = (strike->scheduled_at_s - strike->onset_s) * 1e3;
            const double to = (strike->decided_at_s - strike->onset_s) * 1e3;
            held.add(++place, from, fmt::format("0 {:.4f}", to - from));
            first.add(place, from);
            decided.add(place, to);
        }
        const std::string paint = gnuplot_colour(colour);
        panel.add(held.text(), "with vectors nohead lw 1 lc " + paint);
        panel.add(first.text(), "with points pt 6 ps 0.45 lc " + paint);
        panel.add(decided.text(),
                  fmt::format("with points pt {} ps 0.5 lc {}", kind == Mark::cancelled ? 2 : 7, paint));
    }
    std::string commands = plot_axes() + level_line(1, first_ms) + level_line(2, release_ms);
    commands += fmt::format(
        "set xrange [{}:{}]\nset yrange [{}:0]\nset xtics {}\nset xlabel 'notes: by outcome, then by lead'\n"
        "set ylabel 'ms before the sound'\n",
        area.x_low, area.x_high, low, std::max(1.0, round_step(count + 1, 12)));
    return {kWidth, 260, commands + panel.text()};
}

PlotScript overview_plot(const PlayResult& result, const Timeline& timeline) {
    const double bin_s = round_step(result.t_end_s - result.t0_s, 120);
    std::map<std::int64_t, std::array<int, 3>> bins;  // heard, false, missed
    const auto count = [&](double t_s, std::size_t kind) {
        ++bins[static_cast<std::int64_t>(std::floor(t_s / bin_s))][kind];
    };
    const std::vector<Mark> kinds = strike_marks(result);
    for (std::size_t i = 0; i < kinds.size(); ++i)
        if (kinds[i] != Mark::cancelled) count(result.strikes[i].onset_s, kinds[i] == Mark::wrong ? 1 : 0);
    for (const TrueContact& contact : result.contacts)
        if (contact.matched_id == 0) count(contact.t_s, 2);
    std::array<std::string, 3> stacks;  // each up to and with its kind
    int highest = 1;
    for (const auto& [bin, counts] : bins) {
        int sum = 0;
        for (std::size_t kind = 0; kind < 3; ++kind) {
            sum += counts[kind];
            fmt::format_to(std::back_inserter(stacks[kind]), "{} {}\n",
                           (static_cast<double>(bin) + 0.5) * bin_s, sum);
        }
        highest = std::max(highest, sum);
    }
    std::string shown;
    for (const double from_s : timeline.starts_s)
        fmt::format_to(std::back_inserter(shown), "{} {} {} 0\n", from_s, -0.07 * highest, timeline.row_s);
    PlotPanel panel;
    for (const auto& [kind, colour] :
         {std::pair{2U, colours::missed}, {1U, colours::wrong}, {0U, colours::released}})
        panel.add(stacks[kind], "with boxes fs solid 1 noborder lc " + gnuplot_colour(colour));
    panel.add(shown, "with vectors nohead lw 6 lc " + gnuplot_colour(colours::axis));
    std::string commands = plot_axes() + round_tics("x", result.t_end_s - result.t0_s, 12);
    commands += fmt::format(
        "set xrange [{}:{}]\nset yrange [{}:{}]\nset ytics {}\nset boxwidth {}\nset xlabel 'time, s'\n"
        "set ylabel 'in {:g} s'\n",
        result.t0_s, result.t_end_s, -0.12 * highest, 1.05 * highest, std::max(1.0, round_step(highest, 4)),
        0.85 * bin_s, bin_s);
    return {kWidth, 190, commands + panel.text()};
}

PlotScript sound_plot(const PlayResult& result) {
    const std::size_t frames = result.audio.size() / 2;
    const double length_s = static_cast<double>(frames) / 48000;
    const PlotArea area = {result.t0_s, result.t0_s + length_s, -1, 1, kWidth, 1};
    const auto [low, high] = std::minmax_element(result.audio.begin(), result.audio.end());
    const double peak = std::max({-static_cast<double>(*low), static_cast<double>(*high), 1e-3});
    PlotPanel panel;
    panel.add(sound_envelope(result.audio, result.t0_s, area.x_low, area.x_high, kWidth),
              "with filledcurves fs solid 1 noborder lc " + gnuplot_colour(colours::wave));
    const std::vector<Mark> kinds = strike_marks(result);
    for (const auto& [kind, colour] :
         {std::pair{Mark::released, colours::released}, {Mark::wrong, colours::wrong}}) {
        ThinnedMarks onsets(area);
        for (std::size_t i = 0; i < kinds.size() && kinds.size() < kWidth; ++i)  // more would be one bar
            if (kinds[i] == kind)
                onsets.add(result.strikes[i].onset_s, -1.16 * peak, fmt::format("0 {:.4f}", 0.1 * peak));
        panel.add(onsets.text(), "with vectors nohead lw 1.3 lc " + gnuplot_colour(colour));
    }
    std::string commands = plot_axes() + round_tics("x", length_s, 12) + round_tics("y", 2 * peak, 4);
    commands +=
        fmt::format("set xrange [{}:{}]\nset yrange [{}:{}]\nset xlabel 'time, s'\nset ylabel 'sample'\n",
                    area.x_low, area.x_high, -1.2 * peak, 1.1 * peak);
    return {kWidth, 200, commands + panel.text()};
}

}  // namespace app
