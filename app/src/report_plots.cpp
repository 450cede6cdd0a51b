#include "report_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <unordered_map>

#include "plot_panel.h"
#include "score_strikes.h"

namespace app {
namespace {

constexpr int kWidth = 1040;
constexpr double kHistogramHalf_ms = 30;

std::string zero_line() {
    return fmt::format("set arrow 1 from 0, graph 0 to 0, graph 1 nohead lw 1 dt (4,3) lc {}\n",
                       gnuplot_colour(colours::axis));
}

std::string level_line(int number, double y) {
    return fmt::format("set arrow {0} from graph 0, first {1} to graph 1, first {1} nohead lw 1 dt (4,3) lc {2}\n",
                       number, y, gnuplot_colour(colours::axis));
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
            notes.push_back({(strike->second->onset_s - contact.t_s) * 1e3, contact.stick, contact.instrument});
    return notes;
}

PlotScript timing_plot(const PlayResult& result) {
    std::map<int, int> bins;
    for (const MatchedNote& note : matched_notes(result)) ++bins[static_cast<int>(std::floor(note.error_ms))];
    std::string data;
    int highest = 1;
    for (const auto& [bin, count] : bins) {
        fmt::format_to(std::back_inserter(data), "{} {}\n", bin + 0.5, count);
        highest = std::max(highest, count);
    }
    PlotPanel panel;
    panel.add(data, "with boxes fs solid 0.75 noborder lc " + gnuplot_colour(colours::released));
    const double step = std::max(1.0, round_step(highest, 5));
    std::string commands = plot_axes() + zero_line();
    commands += fmt::format(
        "set xrange [{0}:{1}]\nset yrange [0:{2}]\nset ytics {3}\nset xtics 5\nset boxwidth 0.9\n"
        "set xlabel 'onset - true contact, ms (positive: sound late)'\nset ylabel 'notes'\n",
        -kHistogramHalf_ms, kHistogramHalf_ms, highest * 1.08, step);
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
    const PlotArea area = {-kHistogramHalf_ms, kHistogramHalf_ms, -0.6, rows - 0.4, kWidth, height * 2};
    PlotPanel panel;
    const double sticks = std::max<double>(static_cast<double>(result.sticks.size()), 1);
    for (std::uint32_t stick = 0; stick < result.sticks.size(); ++stick) {
        ThinnedMarks marks(area);
        const double lift = 0.5 * ((stick + 0.5) / sticks - 0.5);  // the sticks of a line lie one above the other
        for (const MatchedNote& note : notes)
            if (note.stick == stick) marks.add(note.error_ms, lines[note.instrument] - lift);
        panel.add(marks.text(), "with points pt 7 ps 0.4 lc " + gnuplot_colour(stick_colour(stick)));
    }
    std::string commands = plot_axes() + zero_line();
    commands += fmt::format("set xrange [{}:{}]\nset yrange [-0.6:{}]\nset xtics 5\nset ytics ({})\n"
                            "set xlabel 'onset - true contact, ms (positive: sound late)'\n",
                            area.x_low, area.x_high, area.y_high, tics);
    return {kWidth / 2, height, commands + panel.text()};
}

PlotScript lead_plot(const PlayResult& result) {
    const double first_ms = -1e3 * result.sound_lead_s, release_ms = -1e3 * result.release_margin_s;
    double low = std::min(first_ms, release_ms) * 1.1;
    for (const Strike& strike : result.strikes) low = std::min(low, (strike.scheduled_at_s - strike.onset_s) * 1.05e3);
    const PlotArea area = {result.t0_s, std::max(result.t_end_s, result.t0_s + 1e-3), low, 0, kWidth, 260};
    const std::vector<Mark> kinds = strike_marks(result);
    PlotPanel panel;
    for (const auto& [kind, colour] : {std::pair{Mark::cancelled, colours::cancelled},
                                       {Mark::released, colours::released},
                                       {Mark::wrong, colours::wrong}}) {
        ThinnedMarks held(area), first(area), decided(area);
        for (std::size_t i = 0; i < result.strikes.size(); ++i) {
            if (kinds[i] != kind) continue;
            const Strike& strike = result.strikes[i];
            const double from = (strike.scheduled_at_s - strike.onset_s) * 1e3;
            const double to = (strike.decided_at_s - strike.onset_s) * 1e3;
            held.add(strike.onset_s, from, fmt::format("0 {:.4f}", to - from));
            first.add(strike.onset_s, from);
            decided.add(strike.onset_s, to);
        }
        const std::string paint = gnuplot_colour(colour);
        panel.add(held.text(), "with vectors nohead lw 1 lc " + paint);
        panel.add(first.text(), "with points pt 6 ps 0.4 lc " + paint);
        panel.add(decided.text(), fmt::format("with points pt {} ps 0.5 lc {}", kind == Mark::cancelled ? 2 : 7, paint));
    }
    std::string commands = plot_axes() + level_line(1, first_ms) + level_line(2, release_ms);
    commands += round_tics("x", area.x_high - area.x_low, 12);
    commands += fmt::format("set xrange [{}:{}]\nset yrange [{}:0]\nset xlabel 'onset, s'\nset ylabel 'ms before the sound'\n",
                            area.x_low, area.x_high, low);
    return {kWidth, 260, commands + panel.text()};
}

PlotScript sound_plot(const PlayResult& result) {
    const double length_s = static_cast<double>(result.audio.size() / 2) / 48000;
    const PlotArea area = {result.t0_s, result.t0_s + length_s, -1, 1, kWidth, 1};
    const auto [low, high] = std::minmax_element(result.audio.begin(), result.audio.end());
    const double peak = std::max({-static_cast<double>(*low), static_cast<double>(*high), 1e-3});
    PlotPanel panel;
    panel.add(sound_envelope(result.audio, result.t0_s, area.x_low, area.x_high, kWidth),
              "with filledcurves fs solid 1 noborder lc " + gnuplot_colour(colours::wave));
    const std::vector<Mark> kinds = strike_marks(result);
    for (const auto& [kind, colour] : {std::pair{Mark::released, colours::released}, {Mark::wrong, colours::wrong}}) {
        ThinnedMarks onsets(area);
        for (std::size_t i = 0; i < kinds.size(); ++i)
            if (kinds[i] == kind) onsets.add(result.strikes[i].onset_s, -1.16 * peak, fmt::format("0 {:.4f}", 0.1 * peak));
        panel.add(onsets.text(), "with vectors nohead lw 1.3 lc " + gnuplot_colour(colour));
    }
    std::string commands = plot_axes() + round_tics("x", length_s, 12) + round_tics("y", 2 * peak, 4);
    commands += fmt::format("set xrange [{}:{}]\nset yrange [{}:{}]\nset xlabel 'time, s'\nset ylabel 'sample'\n",
                            area.x_low, area.x_high, -1.2 * peak, 1.1 * peak);
    return {kWidth, 200, commands + panel.text()};
}

}  // namespace app
