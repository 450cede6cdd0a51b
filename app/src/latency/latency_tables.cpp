#include "latency/latency_tables.h"

#include <fmt/format.h>

#include <iterator>

#include "play/tables.h"
#include "report/table.h"

namespace app {
namespace {

using Out = std::back_insert_iterator<std::string>;

void add_stage(Out out, const LatencyStage& stage) {
    fmt::format_to(out, "{:<19} {:>7} {:>9.3f} {:>9.3f} {:>9.3f} {:>9.3f}  {}\n", stage.name,
                   stage.ms.count(), stage.ms.percentile(50), stage.ms.percentile(95),
                   stage.ms.percentile(99), stage.ms.max(), stage.meaning);
}

void add_deadline(Out out, const Deadline& deadline) {
    fmt::format_to(out, "{:<19} {:>7} {:>9}  {}\n", deadline.name, deadline.total, deadline.missed,
                   deadline.meaning);
}

void add_spread(Out out, const char* name, const Spread& ms) {
    if (ms.empty()) return;
    fmt::format_to(out, "{:<19} {:>7} {:>+9.1f} {:>+9.1f} {:>+9.1f} {:>+9.1f} {:>+9.1f}\n", name, ms.count(),
                   ms.min(), ms.percentile(5), ms.percentile(50), ms.percentile(95), ms.max());
}

void add_sound_and_picture(Out out, const LatencyReport& report) {
    fmt::format_to(out, "\n{:<19} {:>7} {:>9} {:>9} {:>9} {:>9} {:>9}\n", "sound minus, ms", "notes", "min",
                   "p5", "median", "p95", "max");
    add_spread(out, "picture", report.sound_minus_picture_ms);
    add_spread(out, "first frame", report.sound_minus_frame_ms);
    fmt::format_to(out,
                   "within ATSC's {:g} to {:+g} ms: {:.1f} %; ITU-R BT.1359's {:g} to {:+g} ms: {:.1f} %; ",
                   kAtscLimits.early_ms, kAtscLimits.late_ms, 100 * report.share_within_atsc(),
                   kItuLimits.early_ms, kItuLimits.late_ms, 100 * report.share_within_itu());
    fmt::format_to(out, "notes whose drawn stick does not strike: {}\n", report.notes_without_picture);
}

std::string milliseconds(const std::optional<double>& value) {
    return value ? fmt::format("{:.1f} ms", *value) : "unknown";
}

template <class Items, class Row>
std::string csv(const char* header, const Items& items, const Row& row) {
    std::string text = std::string(header) + "\n";
    for (const auto& item : items) row(std::back_inserter(text), item);
    return text;
}

}  // namespace

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

std::string format_latency_text(const LatencyReport& report, const RealtimeResult& realtime) {
    std::string text;
    const Out out(text);
    fmt::format_to(out, "{:.1f} s, {} laps, {}\n\n", realtime.seconds, realtime.laps, realtime.audio_device);
    fmt::format_to(out, "{:<19} {:>7} {:>9} {:>9} {:>9} {:>9}\n", "stage, ms", "count", "p50", "p95", "p99",
                   "max");
    for (const LatencyStage& stage : report.stages) add_stage(out, stage);
    fmt::format_to(out, "\n{:<19} {:>7} {:>9}\n", "deadlines", "total", "missed");
    for (const Deadline* deadline : {&report.samples, &report.notes, &report.blocks, &report.frames})
        add_deadline(out, *deadline);
    if (report.frames_left_out > 0)
        fmt::format_to(out, "{} more frames were left out: the rate was lowered\n", report.frames_left_out);
    add_sound_and_picture(out, report);
    fmt::format_to(out, "\nleads needed: pictures {}, sound {}\n", milliseconds(report.render_lead_needed_ms),
                   milliseconds(report.sound_lead_needed_ms));
    if (!report.errors.empty())
        fmt::format_to(out, "drawn sticks, RMS error on the screen: {:.1f} mm\n",
                       rms_mm(report.errors, 0, 1e300));
    return text;
}

std::string format_samples_csv(const PlayResult& play, const RealtimeResult& realtime) {
    return csv(
        "stick,lap,t_s,due_ns,read_ns,filtered_ns,taken_ns,query_ns,contact_ns,handed_ns,skipped,late_s",
        realtime.samples, [&](Out out, const SampleTiming& s) {
            fmt::format_to(out, "{},{},{},{},{},{},{},{},{},{},{},{}\n", csv_field(play.sticks.at(s.stick)),
                           s.lap, s.t_s, s.due_ns, s.read_ns, s.filtered_ns, s.taken_ns, s.query_ns,
                           s.contact_ns, s.handed_ns, s.skipped, s.late_s);
        });
}

std::string format_frames_csv(const RealtimeResult& realtime) {
    return csv(
        "index,fate,asked_for,lead_s,quality,pose_age_s,shown_ns,query_ns,started_ns,drawn_ns,read_ns,"
        "written_ns",
        realtime.frames, [](Out out, const FrameTiming& f) {
            fmt::format_to(out, "{},{},{:d},{},{},{},{},{},{},{},{},{}\n", f.index, name_of(f.fate),
                           f.asked_for, f.lead_s, f.quality, f.oldest_sample_age_s, f.shown_ns, f.query_ns,
                           f.started_ns, f.drawn_ns, f.read_ns, f.written_ns);
        });
}

std::string format_notes_csv(const LatencyReport& report, const PlayResult& play,
                             const RealtimeResult& realtime) {
    auto picture = report.pictures.begin();
    std::size_t next = 0;
    return csv(
        "id,stick,instrument,lap,onset_s,late_s,pose_age_s,planned_sample,onset_sample,taken_ns,"
        "midi_sent_ns,touch_s,sound_minus_picture_ms,sound_minus_frame_ms",
        realtime.notes, [&](Out out, const NoteTiming& n) {
            const Strike& strike = play.strikes.at(n.strike);
            fmt::format_to(
                out, "{},{},{},{},{},{},{},{},{},{},{},", strike.id, csv_field(play.sticks.at(strike.stick)),
                csv_field(play.instruments.at(strike.instrument)), n.lap,
                onset_in_lap_s(n, play.t0_s, realtime.period_s), n.late_s, n.pose_age_s,
                n.played.planned_sample, n.played.onset_sample, n.played.taken_ns, n.played.midi_sent_ns);
            const std::size_t number = next++;
            if (picture == report.pictures.end() || picture->note != number) {
                fmt::format_to(out, ",,\n");
                return;
            }
            fmt::format_to(out, "{},{},", picture->touch_s, picture->sound_minus_picture_ms());
            if (const auto frame = picture->sound_minus_frame_ms()) fmt::format_to(out, "{}", *frame);
            fmt::format_to(out, "\n");
            ++picture;
        });
}

std::string format_blocks_csv(const RealtimeResult& realtime) {
    return csv("planned_ns,started_ns,done_ns", realtime.blocks, [](Out out, const audio::BlockTiming& b) {
        fmt::format_to(out, "{},{},{}\n", b.planned_ns, b.started_ns, b.done_ns);
    });
}

std::string format_leads_csv(const RealtimeResult& realtime) {
    return csv("at_s,render_lead_s,sound_lead_s,render_delay_s,sound_delay_s,quality,fps,why", realtime.leads,
               [](Out out, const LeadStep& l) {
                   fmt::format_to(out, "{},{},{},{},{},{},{},{}\n", l.at_s, l.render_lead_s, l.sound_lead_s,
                                  l.render_delay_s, l.sound_delay_s, l.quality, l.fps, csv_field(l.why));
               });
}

std::string format_errors_csv(const LatencyReport& report, const PlayResult& play) {
    return csv("at_s,stick,error_mm", report.errors, [&](Out out, const DrawnError& e) {
        fmt::format_to(out, "{},{},{}\n", e.at_s, csv_field(play.sticks.at(e.stick)), 1e3 * e.error_m);
    });
}

}  // namespace app
