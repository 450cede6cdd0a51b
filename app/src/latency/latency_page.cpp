#include "latency/latency_page.h"

#include <fmt/format.h>

#include <iterator>

#include "latency/latency_plots.h"
#include "report/report_style.h"
#include "statistics/statistics.h"

namespace app {
namespace {

std::string heading(const PlayResult& play, const RealtimeResult& r) {
    const std::string name = std::filesystem::path(play.trace).filename().string();
    std::string text =
        fmt::format("<header><h1>Latency of {}</h1>\n<p>on {} in real time, by MusicWorld</p>\n", html(name),
                    html(play.kit_name));
    text += "<dl class=facts>\n" + report_fact("source", play.trace) + report_fact("kit", play.kit);
    text += report_fact("run", fmt::format("{:.1f} s, {} laps", r.seconds, r.laps));
    text += report_fact("pictures predicted by", play.picture_predictor);
    text += report_fact("sounds predicted by", play.sound_predictor);
    text += report_fact("sound goes to", fmt::format("{}; a block is begun {:.1f} ms before it is due",
                                                     r.audio_device, 1e3 * r.output_lead_s));
    for (const auto& [thread, obtained] : r.priorities)
        text += report_fact("priority of " + thread, obtained);
    for (const ClockReport& clock : r.clocks)
        text +=
            report_fact("clock", fmt::format("{}: offset {:.3f} ms, drift {:.1f} ppm, arrival p95 {:.2f} ms "
                                             "behind the earliest, {} jumps",
                                             clock.clock, 1e3 * clock.offset_s, clock.drift_ppm,
                                             clock.delay_p95_ms, clock.jumps));
    return text + "</dl></header>\n";
}

std::string signed_ms(const Spread& ms, double percent) {
    return ms.empty() ? "none" : fmt::format("{:+.1f} ms", ms.percentile(percent));
}

std::string needed(const std::optional<double>& ms) {
    return ms ? fmt::format("{:.1f} ms", *ms) : "unknown";
}

std::string figures(const LatencyReport& r) {
    const auto missed = [](const Deadline& d) { return fmt::format("{} of {}", d.missed, d.total); };
    const auto tone = [](const Deadline& d) { return d.missed == 0 ? "released" : "wrong"; };
    std::string text = "<section class=figures>\n";
    text += report_figure(missed(r.frames), "frames missed", tone(r.frames));
    text += report_figure(missed(r.notes), "notes late", tone(r.notes));
    text += report_figure(missed(r.blocks), "blocks late", tone(r.blocks));
    text += report_figure(missed(r.samples), "samples late", tone(r.samples));
    text += report_figure(signed_ms(r.sound_minus_picture_ms, 50), "sound - picture", "axis");
    text += report_figure(needed(r.render_lead_needed_ms), "lead pictures need", "axis");
    text += report_figure(needed(r.sound_lead_needed_ms), "lead sound needs", "axis");
    if (!r.errors.empty())
        text +=
            report_figure(fmt::format("{:.1f} mm", rms_mm(r.errors, 0, 1e300)), "RMS on the screen", "axis");
    return text + "</section>\n";
}

std::string stage_table(const LatencyReport& report) {
    std::string text =
        "<div class=scroll><table><tr><th>stage<th>from what to what<th class=n>count<th class=n>p50 ms<th "
        "class=n>p95"
        "<th class=n>p99<th class=n>max</tr>\n";
    for (const LatencyStage& s : report.stages)
        fmt::format_to(
            std::back_inserter(text),
            "<tr><td>{}<td>{}<td class=n>{}<td class=n>{:.3f}<td class=n>{:.3f}<td class=n>{:.3f}<td "
            "class=n>{:.3f}</tr>\n",
            html(s.name), html(s.meaning), s.ms.count(), s.ms.percentile(50), s.ms.percentile(95),
            s.ms.percentile(99), s.ms.max());
    return text + "</table></div>\n";
}

std::string sound_picture_note(const LatencyReport& report) {
    return fmt::format(
        "<p class=note>A note's onset in the output minus the time at which the drawn path of its stick, a "
        "cubic "
        "Hermite curve through the tips predicted for the frames shown, comes into the instrument's surface. "
        "Frames "
        "that hold a stick at a coming contact count with the prediction of that contact, which the sound's "
        "filter "
        "made a render lead before. The screen shows no time between frames: the first frame that shows the "
        "stick at "
        "or behind the surface is up to a frame later (p5 {}, median {}, p95 {} against that). {:.1f} % of "
        "all notes "
        "lie within ATSC's limit, {:.1f} % of those with a picture within ITU's; of {} notes the drawn stick "
        "did not "
        "strike within {:g} ms.</p>\n",
        signed_ms(report.sound_minus_frame_ms, 5), signed_ms(report.sound_minus_frame_ms, 50),
        signed_ms(report.sound_minus_frame_ms, 95), 100 * report.share_within_atsc(),
        100 * report.share_within_itu(), report.notes_without_picture, 1e3 * kPictureWindowS);
}

std::string remarks(const RealtimeResult& realtime) {
    std::string rows;
    for (const SensorEvent& event : realtime.events)
        rows += fmt::format("<tr><td class=n>{:.2f}<td>{}</tr>\n", event.at_s, html(event.message));
    for (const LeadStep& step : realtime.leads)
        if (!step.why.empty())
            rows += fmt::format("<tr><td class=n>{:.2f}<td>{}</tr>\n", step.at_s, html(step.why));
    if (rows.empty()) return {};
    return "<h2>What happened</h2>\n<div class=scroll><table><tr><th class=n>s<th>event</tr>\n" + rows +
           "</table></div>\n";
}

}  // namespace

std::string format_latency_page(const LatencyReport& report, const PlayResult& play,
                                const RealtimeResult& realtime, const std::filesystem::path& scratch) {
    PlotGallery plots;
    const std::size_t sound =
                          plots.add(stage_plot(report, LatencyStage::Kind::sound), "From sensor to sound"),
                      picture = plots.add(stage_plot(report, LatencyStage::Kind::picture), "Pictures"),
                      apart = plots.add(sound_picture_plot(report), "Sound minus picture"),
                      close = plots.add(sound_picture_close_plot(report), "The same close up"),
                      leads = plots.add(leads_plot(realtime), "Leads and delays"),
                      frames = plots.add(frames_plot(realtime), "Frames"),
                      errors = plots.add(error_plot(report), "Error of the drawn sticks");
    plots.draw(scratch);
    std::string body = heading(play, realtime) + figures(report) + plots.symbols();
    body += "<h2>Stages</h2>\n" + stage_table(report) + plots.pair({sound, picture});
    body += "<h2>Sound and picture</h2>\n" + sound_picture_note(report) + plots.pair({apart, close});
    body += "<h2>Over time</h2>\n" + plots.element(leads) + plots.element(frames) + plots.element(errors);
    body += remarks(realtime);
    return report_page("Latency of " + std::filesystem::path(play.trace).filename().string(), body);
}

}  // namespace app
