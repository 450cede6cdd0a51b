#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "latency/latency_report.h"
#include "process/clock.h"
#include "report/plot.h"

namespace app {
namespace {

constexpr int kWide = 1040, kHalf = 520;

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

/// Of the values within a range.
Histogram histogram_within(const Spread& ms, double bin_ms, double low_ms, double high_ms) {
    const auto low = std::ranges::lower_bound(ms.sorted(), low_ms);
    return histogram({low, std::ranges::upper_bound(low, ms.sorted().end(), high_ms)}, bin_ms);
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

std::string points(const PlotLine& look, double size) {
    return fmt::format("with points pt 7 ps {} lc {}", size, gnuplot_colour(look.colour));
}

double pixels_ms_after_due(const FrameTiming& frame) {
    return 1e-6 * static_cast<double>(frame.read_ns - frame.shown_ns);
}

/// Share of the values that are longer, over the value; a line for each stage of that kind. Both axes
/// logarithmic, so that a straight look shows 1 in 2, in 20, in 100 and the rare ones.
PlotScript stage_plot(const LatencyReport& report, LatencyStage::Kind kind) {
    constexpr double kLeastMs = 1e-5;
    std::vector<PlotLine> legend;
    PlotPanel panel;
    double low = 1e9, high = 1e-3, rarest = 0.1;
    for (const LatencyStage& stage : report.stages) {
        if (stage.kind != kind) continue;
        legend.push_back(line_of(legend.size(), stage.name));
        panel.add(longer_shares(stage.ms, kLeastMs), style_of(legend.back(), 1.6));
        low = std::min(low, std::max(stage.ms.percentile(5), kLeastMs));
        high = std::max(high, stage.ms.percentile(100));
        rarest = std::min(rarest, 1 / static_cast<double>(stage.ms.count()));
    }
    return plot_of(kHalf, 320, {"ms", std::min(low, high) / 1.5, high * 1.5},
                   {"share that took longer", rarest / 1.5, 1}, panel, "set logscale xy\nset format '%g'\n",
                   legend);
}

/// Leads in force and the delays that they follow over the run.
PlotScript leads_plot(const RealtimeResult& realtime) {
    const std::pair<PlotLine, double LeadStep::*> series[] = {
        {{"lead of pictures", colours::sticks[0]}, &LeadStep::render_lead_s},
        {{"their delay", colours::sticks[0], true}, &LeadStep::render_delay_s},
        {{"lead of sound", colours::sticks[1]}, &LeadStep::sound_lead_s},
        {{"its delay", colours::sticks[1], true}, &LeadStep::sound_delay_s}};
    std::vector<PlotLine> legend;
    PlotPanel panel;
    double highest = 10;
    for (const auto& [line, value] : series) {
        const auto ms = [value = value](const LeadStep& step) { return 1e3 * step.*value; };
        // Delays are measured where leads follow them.
        if (std::ranges::all_of(
                realtime.leads, [](double delay) { return delay == 0; }, ms))
            continue;
        std::string data;
        for (const LeadStep& step : realtime.leads) {
            fmt::format_to(std::back_inserter(data), "{:.3f} {:.4f}\n", step.at_s, ms(step));
            highest = std::max(highest, ms(step));
        }
        fmt::format_to(std::back_inserter(data), "{:.3f} {:.4f}\n",
                       std::max(realtime.seconds, realtime.leads.back().at_s), ms(realtime.leads.back()));
        legend.push_back(line);
        panel.add(data, fmt::format("with steps lt 1 lw 1.6{} lc {}", line.dashed ? " dt '-'" : "",
                                    gnuplot_colour(line.colour)));
    }
    return plot_of(kWide, 260, {"time, s", 0, std::max(realtime.seconds, 1e-3)}, {"ms", 0, highest * 1.1, 6},
                   panel, {}, legend);
}

/// Sound minus picture with the 10 +- 3 ms of drummers; `close`: also against the first frame behind the
/// surface, else with the limits of ITU-R BT.1359 and ATSC.
PlotScript sound_picture_plot(const LatencyReport& report, double bin_ms, double low, double high,
                              bool close) {
    const Histogram path = histogram_within(report.sound_minus_picture_ms, bin_ms, low, high),
                    frame = histogram_within(report.sound_minus_frame_ms, bin_ms, low, high);
    const double top = 1.08 * (close ? std::max(path.highest, frame.highest) : path.highest);
    std::vector<PlotLine> legend = {kPicture};
    PlotPanel panel;
    panel.add(path.data, boxes_of(kPicture.colour));
    if (close) {
        panel.add(frame.data, "with histeps lt 1 lw 1.4 lc " + gnuplot_colour(kFrame.colour));
        legend.push_back(kFrame);
    } else {
        for (const auto& [limits, look] : {std::pair{kAtscLimits, kAtsc}, {kItuLimits, kItu}}) {
            for (const double x : {limits.early_ms, limits.late_ms})
                panel.add(fmt::format("{} 0\n{} {}\n", x, x, top), style_of(look, 1.4));
            legend.push_back(look);
        }
    }
    legend.push_back(kDrummers);
    return plot_of(
        kHalf, 260, {"sound - picture, ms (positive: sound late)", low, high},
        {fmt::format("strikes in {:g} ms", bin_ms), 0, top}, panel,
        drummers_box(top) + fmt::format("set xtics {}\nset boxwidth {}\n", 10 * bin_ms, 0.9 * bin_ms),
        legend);
}

/// When each frame's pixels were there, before (below 0) or after it was due; missed ones marked.
PlotScript frames_plot(const RealtimeResult& realtime) {
    double low = -5, high = 5, last_s = realtime.seconds;
    for (const FrameTiming& frame : realtime.frames) {
        last_s = std::max(last_s, to_s(frame.shown_ns));
        if (frame.read_ns == 0) continue;
        low = std::min(low, pixels_ms_after_due(frame) - 2);
        high = std::max(high, pixels_ms_after_due(frame) + 2);
    }
    const PlotArea area{0, std::max(last_s, 1e-3), low, high, kWide, 240};
    ThinnedMarks in_time(area), late(area), skipped(area);
    for (const FrameTiming& frame : realtime.frames) {
        const double at_s = to_s(frame.shown_ns);
        if (!frame.asked_for) continue;
        if (frame.fate == FrameFate::skipped)
            skipped.add(at_s, 0);
        else
            (frame.fate == FrameFate::late ? late : in_time).add(at_s, pixels_ms_after_due(frame));
    }
    const PlotLine shown{"in time", colours::released}, missed{"late: not shown", colours::wrong},
        never{"skipped: not drawn", colours::missed};
    PlotPanel panel;
    panel.add(in_time.text(), points(shown, 0.25));
    panel.add(late.text(), points(missed, 0.5));
    panel.add(skipped.text(), points(never, 0.5));
    panel.add(fmt::format("0 0\n{} 0\n", area.x_high),
              "with lines lt 1 lw 1 lc " + gnuplot_colour(colours::axis));
    return plot_of(kWide, 260, {"due on the screen, s", 0, area.x_high},
                   {"pixels there after that, ms", low, high, 6}, panel, {}, {shown, missed, never});
}

/// RMS error of the drawn sticks, a point for each half second.
PlotScript error_plot(const LatencyReport& report) {
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
    return plot_of(kWide, 220, {"time, s", 0, end_s}, {"mm", 0, 1.1 * highest, 5}, panel, {}, {line});
}

std::string trace_name(const PlayResult& play) {
    return std::filesystem::path(play.trace).filename().string();
}

std::string heading(const PlayResult& play, const RealtimeResult& r) {
    std::vector<std::pair<std::string, std::string>> facts = {
        {"source", play.trace},
        {"kit", play.options.kit.string()},
        {"run", fmt::format("{:.1f} s, {} lap{}", r.seconds, r.laps, r.laps == 1 ? "" : "s")},
        {"pictures predicted by", play.options.picture_predictor},
        {"sounds predicted by", play.options.sound_predictor},
        {"sound goes to", fmt::format("{}, {:.1f} ms late; a block is begun {:.1f} ms before it is due",
                                      r.audio_device, 1e3 * r.device_delay_s, 1e3 * r.output_lead_s)}};
    for (const auto& [thread, obtained] : r.priorities) facts.emplace_back("priority of " + thread, obtained);
    return report_header("Latency of " + trace_name(play),
                         fmt::format("on {} in real time, by MusicWorld", play.kit_name), facts);
}

std::string signed_ms(const Spread& ms, double percent) {
    return ms.empty() ? "none" : fmt::format("{:+.1f} ms", ms.percentile(percent));
}

std::string figures(const LatencyReport& r) {
    std::vector<PageFigure> all;
    const std::pair<const Deadline*, const char*> deadlines[] = {
        {&r.frames, "frames missed"}, {&r.notes, "notes late"},        {&r.blocks, "blocks late"},
        {&r.samples, "samples late"}, {&r.skipped, "samples skipped"}, {&r.strokes, "strokes missed"}};
    for (const auto& [d, name] : deadlines)
        all.push_back(
            {fmt::format("{} of {}", d->missed, d->total), name, d->missed == 0 ? "released" : "wrong"});
    all.push_back({signed_ms(r.sound_minus_picture_ms, 50), "sound - picture", "axis"});
    all.push_back({milliseconds(r.render_lead_needed_ms), "lead pictures need", "axis"});
    all.push_back({milliseconds(r.sound_lead_needed_ms), "lead sound needs", "axis"});
    if (r.rms_error_mm)
        all.push_back({fmt::format("{:.1f} mm", *r.rms_error_mm), "RMS on the screen", "axis"});
    return report_figures(all);
}

std::string sound_picture_note(const LatencyReport& report) {
    std::string shares = report.notes.total == 0 ? "There were no notes" : "No note has a picture";
    if (const std::optional<double> atsc = report.share_within(kAtscLimits))
        shares = fmt::format(
            "{:.1f} % of the notes with a picture lie within ATSC's limits, {:.1f} % within ITU's",
            100 * *atsc, 100 * report.share_within(kItuLimits).value());
    return fmt::format(
        "<p class=note>A note's onset in the output minus the time at which the drawn path of its stick, "
        "a cubic Hermite curve through the tips predicted for the frames shown, comes into the "
        "instrument's surface. Frames that hold a stick at a coming contact count with the prediction of "
        "that contact, which the sound's filter made a render lead before. The screen shows no time "
        "between frames: the first frame that shows the stick at or behind the surface is up to a frame "
        "later (p5 {}, median {}, p95 {} against that). {}; of {} notes the drawn stick did not strike "
        "within {:g} ms.</p>\n",
        signed_ms(report.sound_minus_frame_ms, 5), signed_ms(report.sound_minus_frame_ms, 50),
        signed_ms(report.sound_minus_frame_ms, 95), shares, report.notes_without_picture,
        1e3 * kPictureWindowS);
}

/// What the sensors and the rule of quality did.
std::string remarks(const RealtimeResult& realtime) {
    Table table = Table::of({"s:.2f", "event"});
    for (const SensorEvent& event : realtime.events) table.add({event.at_s, event.message});
    for (const LeadStep& step : realtime.leads)
        if (step.change >= 0) table.add({step.at_s, realtime.why(step)});
    return table.rows.empty() ? std::string() : "<h2>What happened</h2>\n" + table.html();
}

}  // namespace

std::string format_latency_page(const LatencyReport& report, const PlayResult& play,
                                const RealtimeResult& realtime, Plotter& plotter) {
    const Spread& ms = report.sound_minus_picture_ms;
    const double low = std::min(-60.0, std::floor(ms.percentile(0))),
                 high = std::max(140.0, std::ceil(ms.percentile(100)));
    const double middle = ms.empty() ? 0 : std::round(ms.percentile(50) / 10) * 10;
    PlotGallery plots;
    std::string body = heading(play, realtime) + figures(report) + plots.symbols();
    const std::string stages =
        plots.element(stage_plot(report, LatencyStage::Kind::sound), "From sensor to sound") +
        plots.element(stage_plot(report, LatencyStage::Kind::picture), "Pictures");
    body += "<h2>Stages</h2>\n<p class=note>Milliseconds.</p>\n" + stage_table(report).html() +
            plots.pair(stages);
    body += "<h2>Deadlines</h2>\n" + deadline_table(report).html();
    const std::string apart =
        plots.element(sound_picture_plot(report, 2, low, high, false), "Sound minus picture") +
        plots.element(sound_picture_plot(report, 1, middle - 40, middle + 40, true), "The same close up");
    body += "<h2>Sound and picture</h2>\n" + sound_picture_note(report) + plots.pair(apart);
    body += "<h2>Over time</h2>\n" + plots.element(leads_plot(realtime), "Leads and delays") +
            plots.element(frames_plot(realtime), "Frames") +
            plots.element(error_plot(report), "Error of the drawn sticks");
    if (!realtime.clocks.empty()) body += "<h2>Clocks</h2>\n" + clock_table(play, realtime).html();
    body += remarks(realtime);
    return report_page("Latency of " + trace_name(play), plots.drawn(std::move(body), plotter));
}

}  // namespace app
