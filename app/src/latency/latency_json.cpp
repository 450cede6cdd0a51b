#include <nlohmann/json.hpp>

#include "latency/latency_tables.h"

namespace app {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const LatencyStage& stage) {
    return {{"name", stage.name},
            {"meaning", stage.meaning},
            {"count", stage.ms.count()},
            {"p50_ms", stage.ms.percentile(50)},
            {"p95_ms", stage.ms.percentile(95)},
            {"p99_ms", stage.ms.percentile(99)},
            {"max_ms", stage.ms.max()}};
}

Json json_of(const Deadline& deadline) {
    return {{"name", deadline.name},
            {"meaning", deadline.meaning},
            {"total", deadline.total},
            {"met", deadline.total - deadline.missed},
            {"missed", deadline.missed}};
}

/// Null figures where there is no value.
Json json_of(const Spread& ms) {
    const auto figure = [&](double value) { return ms.empty() ? Json() : Json(value); };
    return {{"p5", figure(ms.percentile(5))},   {"median", figure(ms.percentile(50))},
            {"p95", figure(ms.percentile(95))}, {"min", figure(ms.min())},
            {"max", figure(ms.max())},          {"count", ms.count()}};
}

Json json_of(const LeadStep& lead) {
    return {{"at_s", lead.at_s},
            {"render_lead_s", lead.render_lead_s},
            {"sound_lead_s", lead.sound_lead_s},
            {"render_delay_s", lead.render_delay_s},
            {"sound_delay_s", lead.sound_delay_s},
            {"quality", lead.quality},
            {"fps", lead.fps},
            {"why", lead.why}};
}

Json json_of(const ClockReport& clock) {
    return {{"clock", clock.clock},
            {"offset_s", clock.offset_s},
            {"drift_ppm", clock.drift_ppm},
            {"delay_p95_ms", clock.delay_p95_ms},
            {"jumps", clock.jumps}};
}

Json json_of(const SensorEvent& event) {
    return {{"at_s", event.at_s}, {"sticks", event.sticks}, {"message", event.message}};
}

template <class Items>
Json array_of(const Items& items) {
    Json array = Json::array();
    for (const auto& item : items) array.push_back(json_of(item));
    return array;
}

Json sound_minus_picture(const LatencyReport& report) {
    const Spread& ms = report.sound_minus_picture_ms;
    Json json = json_of(ms);
    json["unmatched"] = report.notes_without_picture;
    json["share_within_atsc"] = ms.empty() ? Json() : Json(report.share_within_atsc());
    json["share_within_itu"] = ms.empty() ? Json() : Json(report.share_within_itu());
    return json;
}

Json frames_of(const LatencyReport& report, const RealtimeResult& realtime) {
    std::size_t late = 0, skipped = 0;
    for (const FrameTiming& frame : realtime.frames) {
        late += frame.asked_for && frame.fate == FrameFate::late;
        skipped += frame.asked_for && frame.fate == FrameFate::skipped;
    }
    return {{"total", report.frames.total},
            {"missed", report.frames.missed},
            {"late", late},
            {"skipped", skipped},
            {"left_out", report.frames_left_out},
            {"not_written", realtime.frames_not_written}};
}

/// RMS errors of the drawn sticks in all and second by second.
Json errors_of(const LatencyReport& report) {
    Json windows = Json::array();
    const double end_s = report.errors.empty() ? -1 : report.errors.back().at_s;
    for (int second = 0; second <= end_s; ++second)
        windows.push_back({{"from_s", second}, {"rms", rms_mm(report.errors, second, second + 1)}});
    return {{"count", report.errors.size()},
            {"rms", report.errors.empty() ? Json() : Json(rms_mm(report.errors, 0, 1e300))},
            {"seconds", windows}};
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

Json if_any(const std::optional<double>& value) {
    return value ? Json(*value) : Json();
}

}  // namespace

std::string format_latency_json(const LatencyReport& report, const PlayResult& play,
                                const RealtimeResult& realtime) {
    const Json json = {
        {"run", run_of(play, realtime)},
        {"stages", array_of(report.stages)},
        {"frames", frames_of(report, realtime)},
        {"notes", {{"total", report.notes.total}, {"late", report.notes.missed}}},
        {"deadlines", Json::array({json_of(report.samples), json_of(report.notes), json_of(report.blocks),
                                   json_of(report.frames)})},
        {"sound_minus_picture_ms", sound_minus_picture(report)},
        {"sound_minus_frame_ms", json_of(report.sound_minus_frame_ms)},
        {"lead_needed_ms",
         {{"render", if_any(report.render_lead_needed_ms)}, {"sound", if_any(report.sound_lead_needed_ms)}}},
        {"drawn_error_mm", errors_of(report)},
        {"leads", array_of(realtime.leads)},
        {"clocks", array_of(realtime.clocks)},
        {"events", array_of(realtime.events)}};
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace app
