#include "play/summary.h"

#include <nlohmann/json.hpp>

#include "strikes/strike_score.h"

namespace app {
namespace {

using Json = nlohmann::ordered_json;

Json strikes(const StrikeScore& score) {
    return {{"true", score.true_contacts},
            {"released", score.released},
            {"cancelled", score.cancelled},
            {"moved", score.moved},
            {"false", score.false_notes},
            {"missed", score.missed},
            {"false_turned_early", score.false_turned_early},
            {"false_turned_late", score.false_turned_late}};
}

Json timing(const StrikeScore& score) {
    const bool any_matched = score.released > score.false_notes;
    return {{"median", any_matched ? Json(score.timing_median_ms) : Json()},
            {"p95", any_matched ? Json(score.timing_p95_ms) : Json()}};
}

template <typename Value>
Json object(const std::vector<std::pair<std::string, Value>>& pairs) {
    Json out = Json::object();
    for (const auto& [name, value] : pairs) out[name] = value;
    return out;
}

Json inputs(const std::vector<InputFile>& files) {
    Json out = Json::array();
    for (const InputFile& input : files) out.push_back({{"file", input.file}, {"sha256", input.sha256}});
    return out;
}

}  // namespace

std::string format_summary(const PlayResult& r, const std::string& realtime_json) {
    const double duration_s = r.t_end_s - r.t0_s;
    Json summary = {
        {"trace", r.trace},
        {"kit", r.kit},
        {"duration_s", duration_s},
        {"frames", r.frames},
        {"picture_predictor", r.picture_predictor},
        {"sound_predictor", r.sound_predictor},
        {"render_lead_s", r.render_lead_s},
        {"sound_lead_s", r.sound_lead_s},
        {"release_margin_s", r.release_margin_s},
        {"strikes", strikes(r.score)},
        {"timing_ms", timing(r.score)},
        {"realtime_factor", r.wall_s > 0 ? Json(duration_s / r.wall_s) : Json()},
        {"stages_s", object(r.stages_s)},
        {"workers", {{"count", r.workers}, {"lost", r.workers_lost}, {"bodies_reowned", r.bodies_reowned}}},
        {"inputs", inputs(r.inputs)},
        {"fingerprint", r.fingerprint},
        {"versions", object(r.versions)},
        {"kit_name", r.kit_name},
        {"trace_source", r.trace_source},
        {"t0_s", r.t0_s},
        {"t_end_s", r.t_end_s},
        {"fps", r.fps},
        {"size", {{"width", r.width}, {"height", r.height}}},
        {"cancelling", r.cancelling},
        {"sticks", r.sticks},
        {"samples_refused", r.samples_refused},
        {"clipped_samples", r.clipped_samples},
        {"wall_s", r.wall_s},
    };
    if (!realtime_json.empty()) summary["realtime"] = Json::parse(realtime_json);
    // File names are bytes: what is not UTF-8 in them becomes U+FFFD.
    return summary.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace app
