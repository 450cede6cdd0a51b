#include "play/play_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <numeric>
#include <set>
#include <unordered_map>

#include "report/spectrogram.h"
#include "statistics/statistics.h"

namespace app {
namespace {

using Kind = Mark::Kind;

constexpr int kWidth = 1040;
constexpr int kColumns = 980;  // of the timeline's panels
constexpr int kHeightPanel = 170, kSoundPanel = 56, kFrame = 34;
constexpr std::size_t kMostRows = 12;
constexpr double kGap_s = 0.25;  // a line is not drawn across a longer gap in the data
constexpr double kLeastPeak = 1e-3;
constexpr const char* kErrorLabel = "onset - true contact, ms (positive: sound late)";

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

/// A dashed line of the axes' colour, its ends as gnuplot has them.
std::string dashed_line(int number, const std::string& from, const std::string& to) {
    return fmt::format("set arrow {} from {} to {} nohead lt 1 lw 1 dt '-' lc {}\n", number, from, to,
                       gnuplot_colour(colours::axis));
}

std::string zero_line() {
    return dashed_line(1, "0, graph 0", "0, graph 1");
}

std::string level_line(int number, double y) {
    return dashed_line(number, fmt::format("graph 0, first {}", y), fmt::format("graph 1, first {}", y));
}

std::string strokes(double width, const ReportColour& colour) {
    return fmt::format("with vectors nohead lw {} lc {}", width, gnuplot_colour(colour));
}

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
    std::set<std::size_t> kept;
    if (end - begin <= 4) {
        for (std::size_t i = begin; i < end; ++i) kept.insert(i);
    } else {
        const auto tip = [&](std::size_t i) { return track.tip.begin() + static_cast<std::ptrdiff_t>(i); };
        const auto [low, high] =
            std::ranges::minmax_element(tip(begin), tip(end), {}, [](const auto& at) { return at.y(); });
        kept = {begin, static_cast<std::size_t>(low - track.tip.begin()),
                static_cast<std::size_t>(high - track.tip.begin()), end - 1};
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
    Kind kind;
    int point_type;
    double size;
};

/// In the order of drawing; gnuplot's point types: 2 cross, 4 frame, 6 ring, 7 disc, 11 triangle pointing
/// down.
constexpr MarkStyle kMarkStyles[] = {{colours::cancelled, Kind::cancelled, 2, 0.85},
                                     {colours::contact, Kind::contact, 6, 0.95},
                                     {colours::released, Kind::released, 7, 0.55},
                                     {colours::missed, Kind::missed, 4, 1.0},
                                     {colours::wrong, Kind::wrong, 11, 0.8}};

std::string height_panel(const PlayResult& result, const std::vector<Mark>& marks, const PlotArea& area) {
    PlotPanel panel;
    for (std::size_t i = 0; i < result.tracks.size(); ++i)
        panel.add(height_line(result.tracks[i], area.x_low, area.x_high),
                  "with lines lw 1.4 lc " + gnuplot_colour(stick_colour(i)));
    for (const MarkStyle& style : kMarkStyles) {
        ThinnedMarks points(area);
        for (const Mark& mark : marks)
            if (mark.kind == style.kind) points.add(mark.t_s, mark.height_m);
        panel.add(points.text(), fmt::format("with points lw 1.6 pt {} ps {} lc {}", style.point_type,
                                             style.size, gnuplot_colour(style.colour)));
    }
    return fmt::format("set yrange [{}:{}]\n", area.y_low, area.y_high) +
           round_tics("y", area.y_high - area.y_low, 4) + "set ylabel 'tip height, m' offset 1\n" +
           panel.text();
}

/// The envelope of the sound, and the onsets of the notes heard and false as strokes that rise from `foot`.
PlotPanel sound_panel(const PlayResult& result, const std::vector<Mark>& marks, const PlotArea& area,
                      double foot, double rise, double width) {
    PlotPanel panel;
    panel.add(sound_envelope(result.sound.samples, result.t0_s, area.x_low, area.x_high, area.width),
              "with filledcurves fs solid 1 noborder lc " + gnuplot_colour(colours::wave));
    for (const auto& [kind, colour] :
         {std::pair{Kind::released, colours::released}, {Kind::wrong, colours::wrong}}) {
        ThinnedMarks onsets(area);
        for (const Mark& mark : marks)
            if (mark.kind == kind) onsets.add(mark.t_s, foot, fmt::format("0 {:.4f}", rise));
        panel.add(onsets.text(), strokes(width, colour));
    }
    return panel;
}

PlotScript row_plot(const PlayResult& result, const std::vector<Mark>& marks, const PlotArea& area,
                    double peak) {
    const bool sound = !result.sound.samples.empty();
    const int height = kHeightPanel + kFrame + (sound ? kSoundPanel : 0);
    const std::string time_axis = round_tics("x", area.x_high - area.x_low, 8);
    std::string commands = plot_axes() + fmt::format("set xrange [{}:{}]\n", area.x_low, area.x_high) +
                           "set multiplot\nset lmargin at screen 0.058\nset rmargin at screen 0.984\n" +
                           plot_margins(8, kHeightPanel, height) + time_axis;
    if (sound) commands += "set format x ''\n";
    commands += height_panel(result, marks, area);
    if (sound)
        commands += plot_margins(kHeightPanel + 6, kHeightPanel + kSoundPanel, height) + time_axis +
                    "set format y '%g'\n" + fmt::format("set yrange [{}:{}]\n", -peak, peak) +
                    "set ytics ('0' 0)\nset ylabel 'sound' offset 1\n" +
                    sound_panel(result, marks, {area.x_low, area.x_high, -peak, peak, kColumns, 1}, -peak,
                                2 * peak, 0.8)
                        .text();
    return {kWidth, height, commands + "unset multiplot\n"};
}

PlotScript timing_plot(const std::vector<MatchedNote>& notes) {
    const ErrorScale scale = error_scale(notes);
    std::vector<double> errors_ms;
    for (const MatchedNote& note : notes) errors_ms.push_back(note.error_ms);
    const auto [data, highest] = histogram(errors_ms, scale.bin_ms);
    PlotPanel panel;
    panel.add(data, boxes_of(colours::released));
    return plot_of(
        kWidth / 2, 260, {kErrorLabel, -scale.half_ms, scale.half_ms},
        {fmt::format("notes in {} ms", scale.bin_ms), 0, highest * 1.08}, panel,
        zero_line() + fmt::format("set ytics {}\nset xtics {}\nset boxwidth {}\n",
                                  std::max(1.0, round_step(highest, 5)), scale.tic_ms, 0.9 * scale.bin_ms));
}

PlotScript timing_by_instrument_plot(const PlayResult& result, const std::vector<MatchedNote>& notes) {
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
    return plot_of(kWidth / 2, height, {kErrorLabel, area.x_low, area.x_high}, {"", area.y_low, area.y_high},
                   panel, zero_line() + fmt::format("set xtics {}\nset ytics ({})\n", scale.tic_ms, tics));
}

PlotScript lead_plot(const PlayResult& result, const std::vector<Mark>& marks) {
    const double first_ms = -1e3 * result.options.sound_lead_s,
                 release_ms = -1e3 * result.options.release_margin_s;
    double low = std::min({first_ms * 1.1, release_ms * 1.1, -1.0});
    for (const Strike& strike : result.strikes)
        low = std::min(low, (strike.scheduled_at_s - strike.onset_s) * 1.05e3);
    const double count = static_cast<double>(result.strikes.size());
    const PlotArea area = {0.5, std::max(count, 1.0) + 0.5, low, 0, kWidth, 260};
    std::vector<Mark> by_lead = marks;
    std::erase_if(by_lead, [](const Mark& mark) { return mark.strike == nullptr; });
    std::ranges::stable_sort(by_lead, std::greater(), [](const Mark& mark) {
        return mark.strike->onset_s - mark.strike->scheduled_at_s;
    });
    int place = 0;
    PlotPanel panel;
    for (const auto& [kind, colour] : {std::pair{Kind::released, colours::released},
                                       {Kind::wrong, colours::wrong},
                                       {Kind::cancelled, colours::cancelled}}) {
        ThinnedMarks held(area), first(area), decided(area);
        for (const Mark& mark : by_lead) {
            if (mark.kind != kind) continue;
            const double from = (mark.strike->scheduled_at_s - mark.t_s) * 1e3;
            const double to = (mark.strike->decided_at_s - mark.t_s) * 1e3;
            held.add(++place, from, fmt::format("0 {:.4f}", to - from));
            first.add(place, from);
            decided.add(place, to);
        }
        const std::string paint = gnuplot_colour(colour);
        panel.add(held.text(), strokes(1, colour));
        panel.add(first.text(), "with points pt 6 ps 0.45 lc " + paint);
        panel.add(decided.text(),
                  fmt::format("with points pt {} ps 0.5 lc {}", kind == Kind::cancelled ? 2 : 7, paint));
    }
    return plot_of(kWidth, 260, {"notes: by outcome, then by lead", area.x_low, area.x_high},
                   {"ms before the sound", low, 0}, panel,
                   level_line(1, first_ms) + level_line(2, release_ms) +
                       fmt::format("set xtics {}\n", std::max(1.0, round_step(count + 1, 12))));
}

PlotScript overview_plot(const PlayResult& result, const std::vector<Mark>& marks, const Timeline& timeline) {
    constexpr std::tuple<std::size_t, Kind, const ReportColour&> kKinds[] = {
        {2, Kind::missed, colours::missed},
        {1, Kind::wrong, colours::wrong},
        {0, Kind::released, colours::released}};
    const double bin_s = round_step(result.t_end_s - result.t0_s, 120);
    std::map<std::int64_t, std::array<int, 3>> bins;  // heard, false, missed
    for (const auto& [number, kind, colour] : kKinds)
        for (const Mark& mark : marks)
            if (mark.kind == kind) ++bins[static_cast<std::int64_t>(std::floor(mark.t_s / bin_s))][number];
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
    for (const auto& [number, kind, colour] : kKinds)
        panel.add(stacks[number], "with boxes fs solid 1 noborder lc " + gnuplot_colour(colour));
    panel.add(shown, strokes(6, colours::axis));
    return plot_of(
        kWidth, 190, {"time, s", result.t0_s, result.t_end_s, 12},
        {fmt::format("in {:g} s", bin_s), -0.12 * highest, 1.05 * highest}, panel,
        fmt::format("set ytics {}\nset boxwidth {}\n", std::max(1.0, round_step(highest, 4)), 0.85 * bin_s));
}

PlotScript sound_plot(const PlayResult& result, const std::vector<Mark>& marks, double peak) {
    const std::size_t frames = result.sound.samples.size() / 2;
    const double length_s = static_cast<double>(frames) / 48000;
    const PlotArea area = {result.t0_s, result.t0_s + length_s, -1, 1, kWidth, 1};
    const bool few = result.strikes.size() < kWidth;  // more would be one bar
    const PlotPanel panel =
        sound_panel(result, few ? marks : std::vector<Mark>(), area, -1.16 * peak, 0.1 * peak, 1.3);
    return plot_of(kWidth, 200, {"time, s", area.x_low, area.x_high, 12}, {"sample", -1.2 * peak, 1.1 * peak},
                   panel, round_tics("y", 2 * peak, 4));
}

/// From the loudest level, rounded up to 10 dB, down by 70 dB.
LevelRange level_range(const Spectrogram& sound) {
    const double loudest = *std::ranges::max_element(sound.level_db);
    const double high_db = std::clamp(10 * std::ceil(loudest / 10), -110.0, 20.0);
    return {high_db - 70, high_db};
}

/// Ticks of a logarithmic axis of which a row is a unit: frequencies as people call them.
std::string frequency_tics(const Spectrogram& sound) {
    std::string tics;
    for (const auto& [hz, name] : {std::pair{50, "50"},
                                   {100, "100"},
                                   {200, "200"},
                                   {500, "500"},
                                   {1000, "1k"},
                                   {2000, "2k"},
                                   {5000, "5k"},
                                   {10000, "10k"},
                                   {20000, "20k"}})
        fmt::format_to(std::back_inserter(tics), "{}'{}' {:.3f}", tics.empty() ? "" : ",", name,
                       sound.rows * std::log(hz / sound.low_hz) / std::log(sound.high_hz / sound.low_hz));
    return fmt::format("set ytics ({})\n", tics);
}

/// The levels as a picture, and above it the onsets of the notes heard and false.
PlotScript spectrogram_plot(const PlayResult& result, const std::vector<Mark>& marks, LevelRange& range) {
    constexpr int kRows = 140;
    const Spectrogram sound =
        spectrogram({result.sound.samples.data(), result.sound.samples.size()}, kColumns, kRows);
    range = level_range(sound);
    const double length_s = static_cast<double>(result.sound.samples.size() / 2) / 48000,
                 column_s = length_s / kColumns;
    std::string levels;
    for (int column = 0; column < kColumns; ++column)
        for (int row = 0; row < kRows; ++row)
            fmt::format_to(std::back_inserter(levels), "{:.5g} {} {:.0f}\n",
                           result.t0_s + (column + 0.5) * column_s, row + 0.5,
                           std::clamp<double>(sound.at(column, row), range.low_db, range.high_db));
    const PlotArea area = {result.t0_s, result.t0_s + length_s, 0, 1.09 * kRows, kColumns, 1};
    PlotPanel panel;
    panel.add(levels, "with image");
    const bool few = result.strikes.size() < kWidth;  // as in sound_plot
    for (const auto& [kind, colour] :
         {std::pair{Kind::released, colours::released}, {Kind::wrong, colours::wrong}}) {
        ThinnedMarks onsets(area);
        for (const Mark& mark : marks)
            if (few && mark.kind == kind)
                onsets.add(mark.t_s, 1.02 * kRows, fmt::format("0 {}", 0.06 * kRows));
        panel.add(onsets.text(), strokes(1.3, colour));
    }
    return plot_of(kWidth, 260, {"time, s", area.x_low, area.x_high, 12}, {"Hz", area.y_low, area.y_high},
                   panel,
                   frequency_tics(sound) +
                       fmt::format("unset grid\nunset colorbox\nset cbrange [{}:{}]\n"
                                   "set palette defined (0 '#0c0d1f', 1 '#3b2a72', 2 '#8d2f81', 3 '#dd513a', "
                                   "4 '#fba40a', 5 '#fcffa4')\n",
                                   range.low_db, range.high_db));
}

}  // namespace

std::vector<Mark> marks_of(const PlayResult& result) {
    std::set<std::uint64_t> matched;
    std::vector<Mark> marks;
    for (const TrueContact& c : result.contacts) {
        matched.insert(c.matched_id);
        marks.push_back({Kind::contact, c.t_s, c.point_world.y(), c.instrument});
        if (c.matched_id == 0) marks.push_back({Kind::missed, c.t_s, c.point_world.y(), c.instrument});
    }
    for (const Strike& s : result.strikes) {
        const Kind heard = matched.contains(s.id) ? Kind::released : Kind::wrong;
        marks.push_back({s.outcome == Outcome::released ? heard : Kind::cancelled, s.onset_s,
                         s.point_world.y(), s.instrument, &s});
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
    for (const Mark& mark : marks_of(result)) {
        if (mark.kind != Kind::wrong && mark.kind != Kind::missed) continue;
        const double row = std::floor((mark.t_s - result.t0_s) / timeline.row_s);
        ++errors[std::min(static_cast<std::size_t>(std::max(row, 0.0)), rows - 1)];
    }
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

PlayPlots add_play_plots(PlotGallery& gallery, const PlayResult& result) {
    const std::vector<Mark> marks = marks_of(result);
    const std::vector<MatchedNote> notes = matched_notes(result);
    const auto [low, high] = height_range(result);
    double peak = kLeastPeak;
    for (const float sample : result.sound.samples)
        peak = std::max(peak, std::abs(static_cast<double>(sample)));
    PlayPlots plots;
    plots.timeline = timeline_of(result);
    const auto framed = [&](PlotScript plot, const char* label) {
        return gallery.framed(gallery.add(std::move(plot), label));
    };
    for (const double from_s : plots.timeline.starts_s)
        plots.rows += gallery.add(
            row_plot(result, marks,
                     {from_s, from_s + plots.timeline.row_s, low, high, kColumns, kHeightPanel}, peak),
            fmt::format("timeline from {:g} s on", from_s));
    plots.rows = gallery.framed(plots.rows);
    plots.timing = framed(timing_plot(notes), "histogram of onset minus true contact");
    plots.instruments =
        framed(timing_by_instrument_plot(result, notes), "onset minus true contact by instrument");
    plots.leads = framed(lead_plot(result, marks), "first prediction and decision of each note");
    if (!result.sound.samples.empty()) {
        plots.sound = framed(sound_plot(result, marks, peak), "envelope of the sound");
        plots.spectrogram = framed(spectrogram_plot(result, marks, plots.levels), "spectrogram of the sound");
    }
    if (!plots.timeline.whole)
        plots.overview =
            framed(overview_plot(result, marks, plots.timeline), "notes heard, false and missed over time");
    return plots;
}

}  // namespace app
