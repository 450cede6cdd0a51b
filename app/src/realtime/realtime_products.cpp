#include "realtime/realtime_products.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "latency/latency_page.h"
#include "latency/latency_tables.h"
#include "play/play_report.h"
#include "play/summary.h"
#include "play/tables.h"

namespace app {
namespace {

using Json = nlohmann::ordered_json;

const char* name_of(SensorEvent::Kind kind) {
    switch (kind) {
        case SensorEvent::Kind::silent:
            return "silent";
        case SensorEvent::Kind::back:
            return "back";
        case SensorEvent::Kind::restarted:
            return "restarted";
        case SensorEvent::Kind::ended:
            return "ended";
        case SensorEvent::Kind::clock_jumped:
            return "clock jumped";
        case SensorEvent::Kind::malformed:
            return "malformed";
        case SensorEvent::Kind::failed:
            return "failed";
    }
    return "";
}

Json frames(const RealtimeResult& r) {
    std::uint64_t total = 0, late = 0, skipped = 0, left_out = 0;
    for (const FrameTiming& frame : r.frames) {
        if (!frame.asked_for) {
            ++left_out;
            continue;
        }
        ++total;
        late += frame.fate == FrameFate::late;
        skipped += frame.fate == FrameFate::skipped;
    }
    return {{"total", total},     {"missed", late + skipped},     {"late", late},
            {"skipped", skipped}, {"left_out_by_rate", left_out}, {"not_written", r.frames_not_written}};
}

Json notes(const RealtimeResult& r) {
    const auto late = std::ranges::count_if(r.notes, [](const NoteTiming& note) { return note.late_s > 0; });
    return {{"total", r.notes.size()},
            {"late", late},
            {"changes_refused", r.refused_changes},
            {"queue_overflows", r.queue_overflows}};
}

Json sensors(const RealtimeResult& r) {
    Json clocks = Json::array(), events = Json::array();
    for (const ClockReport& clock : r.clocks)
        clocks.push_back({{"clock", clock.clock},
                          {"offset_s", clock.offset_s},
                          {"drift_ppm", clock.drift_ppm},
                          {"delay_p95_ms", clock.delay_p95_ms},
                          {"jumps", clock.jumps}});
    for (const SensorEvent& event : r.events)
        events.push_back({{"at_s", event.at_s}, {"kind", name_of(event.kind)}, {"message", event.message}});
    return {{"clocks", clocks}, {"events", events}};
}

Json quality(const RealtimeResult& r) {
    Json changes = Json::array();
    for (const LeadStep& step : r.leads)
        if (!step.why.empty())
            changes.push_back({{"at_s", step.at_s}, {"level", step.quality}, {"why", step.why}});
    return {{"levels", r.quality_levels},
            {"first", r.leads.empty() ? Json() : Json(r.leads.front().quality)},
            {"last", r.leads.empty() ? Json() : Json(r.leads.back().quality)},
            {"changes", changes}};
}

Json departures(const RealtimeOutcome& o) {
    const auto unexplained =
        std::ranges::count_if(o.departures, [](const Divergence& d) { return d.cause == "unexplained"; });
    return {{"offline_strikes", o.offline_strikes},
            {"departures", o.departures.size()},
            {"unexplained", unexplained}};
}

Json section(const RealtimeOutcome& o) {
    const RealtimeResult& r = o.realtime;
    Json priorities = Json::object();
    for (const auto& [thread, obtained] : r.priorities) priorities[thread] = obtained;
    return {{"seconds", r.seconds},
            {"laps", r.laps},
            {"period_s", r.period_s},
            {"output_lead_s", r.output_lead_s},
            {"frames", frames(r)},
            {"notes", notes(r)},
            {"against_offline", departures(o)},
            {"quality", quality(r)},
            {"sensors", sensors(r)},
            {"priorities", priorities},
            {"disturbed_by", r.disturbed_by},
            {"audio_device", r.audio_device},
            {"device_underruns", r.device_underruns},
            {"device_corrections", r.device_corrections},
            {"midi_late", r.midi_late},
            {"midi_lost", r.midi_lost}};
}

}  // namespace

std::string format_realtime_section(const RealtimeOutcome& outcome) {
    return section(outcome).dump(2, ' ', false, Json::error_handler_t::replace);
}

std::string format_departures(const RealtimeOutcome& outcome) {
    std::string text = "lap,stick,instrument,what,offline_onset_s,onset_s,cause,delay_ms\n";
    const auto time = [](double s) { return std::isnan(s) ? std::string() : fmt::format("{}", s); };
    for (const Divergence& d : outcome.departures)
        text += fmt::format("{},{},{},{},{},{},{},{:.3f}\n", d.lap, outcome.play.sticks[d.stick],
                            outcome.play.instruments[d.instrument], d.what, time(d.offline_onset_s),
                            time(d.onset_s), d.cause, 1e3 * d.delay_s);
    return text;
}

void write_latency_products(const RealtimeOutcome& o, const OutputFolder& folder) {
    write_file(folder.path("samples.csv"), format_samples_csv(o.play, o.realtime));
    write_file(folder.path("frames.csv"), format_frames_csv(o.realtime));
    write_file(folder.path("notes.csv"), format_notes_csv(o.latency, o.play, o.realtime));
    write_file(folder.path("blocks.csv"), format_blocks_csv(o.realtime));
    write_file(folder.path("leads.csv"), format_leads_csv(o.realtime));
    write_file(folder.path("errors.csv"), format_errors_csv(o.latency, o.play));
    write_file(folder.path("latency.json"), format_latency_json(o.latency, o.play, o.realtime));
    write_file(folder.path("latency.html"),
               format_latency_page(o.latency, o.play, o.realtime, folder.scratch()));
}

void write_realtime_products(const RealtimeOutcome& outcome, const OutputFolder& folder) {
    write_file(folder.path("events.csv"), format_events(outcome.play));
    write_file(folder.path("contacts.csv"), format_contacts(outcome.play));
    write_file(folder.path("departures.csv"), format_departures(outcome));
    write_file(folder.path("report.html"), format_report(outcome.play, folder.scratch()));
    write_file(folder.path("summary.json"), format_summary(outcome.play, format_realtime_section(outcome)));
}

}  // namespace app
