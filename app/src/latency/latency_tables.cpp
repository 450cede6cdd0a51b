#include "latency/latency_tables.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace app {
namespace {

using Json = nlohmann::ordered_json;

const char* name_of(FrameFate fate) {
    switch (fate) {
        case FrameFate::in_time:
            return "in time";
        case FrameFate::late:
            return "late";
        case FrameFate::skipped:
            break;
    }
    return "skipped";
}

Json events_of(const RealtimeResult& realtime) {
    Json events = Json::array();
    for (const SensorEvent& event : realtime.events)
        events.push_back({{"at_s", event.at_s}, {"sticks", event.sticks}, {"message", event.message}});
    return events;
}

Json frames_of(const LatencyReport& report, const RealtimeResult& realtime) {
    return {{"total", report.frames.total},       {"missed", report.frames.missed},
            {"late", report.frames_late},         {"skipped", report.frames_skipped},
            {"left_out", report.frames_left_out}, {"not_written", realtime.frames_not_written}};
}

/// RMS errors of the drawn sticks in all and second by second.
Json errors_of(const LatencyReport& report) {
    Json windows = Json::array();
    const double end_s = report.errors.empty() ? -1 : report.errors.back().at_s;
    for (int second = 0; second <= end_s; ++second)
        windows.push_back({{"from_s", second}, {"rms", rms_mm(report.errors, second, second + 1)}});
    return {{"count", report.errors.size()}, {"rms", Cell(report.rms_error_mm).json()}, {"seconds", windows}};
}

Json run_of(const PlayResult& play, const RealtimeResult& realtime) {
    Json priorities = Json::object();
    for (const auto& [thread, obtained] : realtime.priorities) priorities[thread] = obtained;
    return {{"trace", play.trace},
            {"kit", play.kit},
            {"picture_predictor", play.picture_predictor},
            {"sound_predictor", play.sound_predictor},
            {"seconds", realtime.seconds},
            {"period_s", realtime.period_s},
            {"laps", realtime.laps},
            {"fps", play.fps},
            {"output_lead_s", realtime.output_lead_s},
            {"release_margin_s", realtime.release_margin_s},
            {"disturbed_by", realtime.disturbed_by},
            {"audio_device", realtime.audio_device},
            {"priorities", priorities},
            {"quality_levels", realtime.quality_levels},
            {"refused_changes", realtime.refused_changes},
            {"queue_overflows", realtime.queue_overflows},
            {"device_underruns", realtime.device_underruns}};
}

std::string milliseconds(const std::optional<double>& value) {
    return value ? fmt::format("{:.1f} ms", *value) : "unknown";
}

}  // namespace

Table stage_table(const LatencyReport& report) {
    Table table =
        Table::of({"name", "meaning", "count:d", "p50_ms:.3f", "p95_ms:.3f", "p99_ms:.3f", "max_ms:.3f"});
    for (const LatencyStage& s : report.stages)
        table.add({s.name, s.meaning, s.ms.count(), s.ms.percentile(50), s.ms.percentile(95),
                   s.ms.percentile(99), s.ms.max()});
    return table;
}

Table deadline_table(const LatencyReport& report) {
    Table table = Table::of({"name", "meaning", "total:d", "met:d", "missed:d"});
    for (const Deadline* d : report.deadlines())
        table.add({d->name, d->meaning, d->total, d->total - d->missed, d->missed});
    return table;
}

Table spread_table(const LatencyReport& report) {
    Table table = Table::of({"sound minus", "p5:+.1f:ms", "median:+.1f:ms", "p95:+.1f:ms", "min:+.1f:ms",
                             "max:+.1f:ms", "count:d"});
    const auto add = [&](const char* name, const Spread& ms) {
        table.add({name, ms.percentile(5), ms.percentile(50), ms.percentile(95), ms.percentile(0),
                   ms.percentile(100), ms.count()});
    };
    add("picture", report.sound_minus_picture_ms);
    add("first frame", report.sound_minus_frame_ms);
    return table;
}

Table clock_table(const RealtimeResult& realtime) {
    Table table = Table::of({"clock", "offset_s:.6f", "drift_ppm:.1f", "delay_p95_ms:.2f", "jumps:d"});
    for (const ClockReport& c : realtime.clocks)
        table.add({c.clock, c.offset_s, c.drift_ppm, c.delay_p95_ms, c.jumps});
    return table;
}

Table sample_table(const PlayResult& play, const RealtimeResult& realtime) {
    Table table = Table::of({"stick", "lap", "t_s", "due_ns", "read_ns", "filtered_ns", "taken_ns",
                             "query_ns", "contact_ns", "handed_ns", "skipped", "late_s"});
    for (const SampleTiming& s : realtime.samples)
        table.add({play.sticks.at(s.stick), s.lap, s.t_s, s.due_ns, s.read_ns, s.filtered_ns, s.taken_ns,
                   s.query_ns, s.contact_ns, s.handed_ns, s.skipped, s.late_s});
    return table;
}

Table frame_table(const RealtimeResult& realtime) {
    Table table = Table::of({"index", "fate", "asked_for", "lead_s", "quality", "pose_age_s", "shown_ns",
                             "query_ns", "started_ns", "drawn_ns", "read_ns", "written_ns"});
    for (const FrameTiming& f : realtime.frames)
        table.add({f.index, name_of(f.fate), f.asked_for, f.lead_s, f.quality, f.oldest_sample_age_s,
                   f.shown_ns, f.query_ns, f.started_ns, f.drawn_ns, f.read_ns, f.written_ns});
    return table;
}

Table note_table(const LatencyReport& report, const PlayResult& play, const RealtimeResult& realtime) {
    Table table = Table::of({"id", "stick", "instrument", "lap", "onset_s", "late_s", "pose_age_s",
                             "planned_sample", "onset_sample", "taken_ns", "midi_sent_ns", "touch_s",
                             "sound_minus_picture_ms", "sound_minus_frame_ms"});
    auto picture = report.pictures.begin();
    for (std::size_t i = 0; i < realtime.notes.size(); ++i) {
        const NoteTiming& n = realtime.notes[i];
        const Strike& strike = play.strikes.at(n.strike);
        table.add({strike.id,
                   play.sticks.at(strike.stick),
                   play.instruments.at(strike.instrument),
                   n.lap,
                   onset_in_lap_s(n, play.t0_s, realtime.period_s),
                   n.late_s,
                   n.pose_age_s,
                   n.played.planned_sample,
                   n.played.onset_sample,
                   n.played.taken_ns,
                   n.played.midi_sent_ns,
                   {},
                   {},
                   {}});
        if (picture == report.pictures.end() || picture->note != i) continue;
        std::vector<Cell>& row = table.rows.back();
        row[11] = picture->touch_s;
        row[12] = picture->sound_minus_picture_ms();
        row[13] = picture->sound_minus_frame_ms();
        ++picture;
    }
    return table;
}

Table block_table(const RealtimeResult& realtime) {
    Table table = Table::of({"planned_ns", "started_ns", "done_ns"});
    for (const audio::BlockTiming& b : realtime.blocks) table.add({b.planned_ns, b.started_ns, b.done_ns});
    return table;
}

Table lead_table(const RealtimeResult& realtime) {
    Table table = Table::of({"at_s", "render_lead_s", "sound_lead_s", "render_delay_s", "sound_delay_s",
                             "quality", "fps", "why"});
    for (const LeadStep& l : realtime.leads)
        table.add({l.at_s, l.render_lead_s, l.sound_lead_s, l.render_delay_s, l.sound_delay_s, l.quality,
                   l.fps, l.why});
    return table;
}

Table error_table(const LatencyReport& report, const PlayResult& play) {
    Table table = Table::of({"at_s", "stick", "error_mm"});
    for (const DrawnError& e : report.errors) table.add({e.at_s, play.sticks.at(e.stick), 1e3 * e.error_m});
    return table;
}

std::string format_latency_text(const LatencyReport& report, const RealtimeResult& realtime) {
    std::string text = fmt::format("{:.1f} s, {} lap{}, {}\n\n", realtime.seconds, realtime.laps,
                                   realtime.laps == 1 ? "" : "s", realtime.audio_device);
    text += stage_table(report).text() + '\n' + deadline_table(report).text();
    if (report.frames_left_out > 0)
        text += fmt::format("left out because the frame rate was lowered: {} more frames\n",
                            report.frames_left_out);
    text += fmt::format("\n{}", spread_table(report).text());
    text +=
        fmt::format("within ATSC's {:g} to {:+g} ms: {:.1f} %; ITU-R BT.1359's {:g} to {:+g} ms: {:.1f} %; ",
                    kAtscLimits.early_ms, kAtscLimits.late_ms, 100 * report.share_within_atsc(),
                    kItuLimits.early_ms, kItuLimits.late_ms, 100 * report.share_within_itu());
    text += fmt::format("notes whose drawn stick does not strike: {}\n", report.notes_without_picture);
    text += fmt::format("\nleads needed: pictures {}, sound {}\n", milliseconds(report.render_lead_needed_ms),
                        milliseconds(report.sound_lead_needed_ms));
    if (report.rms_error_mm)
        text += fmt::format("drawn sticks, RMS error on the screen: {:.1f} mm\n", *report.rms_error_mm);
    return text;
}

std::string format_latency_json(const LatencyReport& report, const PlayResult& play,
                                const RealtimeResult& realtime) {
    Json spreads = spread_table(report).json();
    for (Json& spread : spreads) spread.erase("sound minus");
    Json& picture = spreads[0];
    const bool none = report.sound_minus_picture_ms.empty();
    picture["unmatched"] = report.notes_without_picture;
    picture["share_within_atsc"] = none ? Json() : Json(report.share_within_atsc());
    picture["share_within_itu"] = none ? Json() : Json(report.share_within_itu());
    const Json json = {{"run", run_of(play, realtime)},
                       {"stages", stage_table(report).json()},
                       {"frames", frames_of(report, realtime)},
                       {"notes", {{"total", report.notes.total}, {"late", report.notes.missed}}},
                       {"samples",
                        {{"taken", report.samples.total},
                         {"late", report.samples.missed},
                         {"skipped", report.skipped.missed}}},
                       {"strokes", {{"total", report.strokes.total}, {"missed", report.strokes.missed}}},
                       {"deadlines", deadline_table(report).json()},
                       {"sound_minus_picture_ms", picture},
                       {"sound_minus_frame_ms", spreads[1]},
                       {"lead_needed_ms",
                        {{"render", Cell(report.render_lead_needed_ms).json()},
                         {"sound", Cell(report.sound_lead_needed_ms).json()}}},
                       {"drawn_error_mm", errors_of(report)},
                       {"leads", lead_table(realtime).json()},
                       {"clocks", clock_table(realtime).json()},
                       {"events", events_of(realtime)}};
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace app
