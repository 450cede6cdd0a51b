#include "realtime/realtime_products.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "latency/latency_page.h"
#include "latency/latency_tables.h"
#include "report/table.h"

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

Json frames(const RealtimeOutcome& o) {
    const LatencyReport& report = o.latency;
    return {{"total", report.frames.total},
            {"missed", report.frames.missed},
            {"late", report.frames_late},
            {"skipped", report.frames_skipped},
            {"left_out_by_rate", report.frames_left_out},
            {"not_written", o.realtime.frames_not_written}};
}

Json notes(const RealtimeOutcome& o) {
    return {{"total", o.latency.notes.total},
            {"late", o.latency.notes.missed},
            {"changes_refused", o.realtime.refused_changes},
            {"queue_overflows", o.realtime.queue_overflows}};
}

Json sensors(const RealtimeResult& r) {
    Json events = Json::array();
    for (const SensorEvent& event : r.events)
        events.push_back({{"at_s", event.at_s}, {"kind", name_of(event.kind)}, {"message", event.message}});
    return {{"clocks", clock_table(r).json()}, {"events", events}};
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
            {"frames", frames(o)},
            {"notes", notes(o)},
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

Table departure_table(const RealtimeOutcome& o) {
    Table table =
        Table::of({"lap", "stick", "instrument", "what", "offline_onset_s", "onset_s", "cause", "delay_ms"});
    for (const Divergence& d : o.departures)
        table.add({d.lap, o.play.sticks[d.stick], o.play.instruments[d.instrument], d.what, d.offline_onset_s,
                   d.onset_s, d.cause, fmt::format("{:.3f}", 1e3 * d.delay_s)});
    return table;
}

}  // namespace

std::string write_realtime_products(RealtimeOutcome& o, const OutputFolder& folder) {
    o.latency = latency_report(o.play, o.realtime, o.kit, o.stick.radius_m);
    const std::pair<const char*, Table> tables[] = {{"departures.csv", departure_table(o)},
                                                    {"samples.csv", sample_table(o.play, o.realtime)},
                                                    {"frames.csv", frame_table(o.realtime)},
                                                    {"notes.csv", note_table(o.latency, o.play, o.realtime)},
                                                    {"blocks.csv", block_table(o.realtime)},
                                                    {"leads.csv", lead_table(o.realtime)},
                                                    {"errors.csv", error_table(o.latency, o.play)}};
    for (const auto& [name, table] : tables) write_file(folder.path(name), table.csv());
    write_file(folder.path("latency.json"), format_latency_json(o.latency, o.play, o.realtime));
    write_file(folder.path("latency.html"),
               format_latency_page(o.latency, o.play, o.realtime, folder.scratch()));
    return section(o).dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace app
