#include <nlohmann/json.hpp>

#include "compare/comparison_map.h"
#include "compare/comparison_pairs.h"
#include "compare/comparison_tables.h"

namespace app {
namespace {

using Json = nlohmann::ordered_json;

Json if_any(double value, bool any) {
    return any ? Json(value) : Json();
}

void put_error(Json& row, const ErrorScore& error) {
    row["rms_mm"] = if_any(error.rms_mm, error.count > 0);
    row["p95_mm"] = if_any(error.p95_mm, error.count > 0);
    row["free_rms_mm"] = if_any(error.free_rms_mm, error.free_count > 0);
    row["unflagged_rms_mm"] = if_any(error.unflagged_rms_mm, error.unflagged_count > 0);
    row["rotation_rms_deg"] = if_any(error.rotation_rms_deg, error.rotation_count > 0);
    row["tip_rms_mm"] = if_any(error.tip_rms_mm, error.rotation_count > 0);
    row["predictions"] = error.count;
}

Json json_of(const std::optional<Calibration>& calibration) {
    if (!calibration) return {};
    return {{"count", calibration->count},
            {"singular", calibration->singular},
            {"inside_50", calibration->inside_50},
            {"inside_95", calibration->inside_95},
            {"negative_log_likelihood", calibration->negative_log_likelihood}};
}

Json json_of(const std::optional<HitScore>& hits) {
    if (!hits) return {};
    return {{"true", hits->true_contacts},
            {"predicted", hits->predicted},
            {"matched", hits->matched},
            {"precision", hits->precision()},
            {"recall", hits->recall()},
            {"f1", hits->f1()},
            {"median_ms", if_any(hits->median_ms(), hits->matched > 0)},
            {"p95_ms", if_any(hits->p95_ms(), hits->matched > 0)},
            {"false_per_min", hits->false_per_min()},
            {"false_per_min_without_cancel", hits->false_per_min_without_cancel()}};
}

Json json_of(const PairedDifference& d) {
    return {{"n", d.n},
            {"ratio", d.ratio},
            {"low", if_any(d.low, d.has_interval())},
            {"high", if_any(d.high, d.has_interval())},
            {"difference_mm", d.difference_mm},
            {"difference_low_mm", if_any(d.difference_low_mm, d.has_interval())},
            {"difference_high_mm", if_any(d.difference_high_mm, d.has_interval())},
            {"verdict", verdict(d)}};
}

Json json_of(const ComparisonRow& row) {
    Json json = {{"trace", row.trace},         {"person", row.person},    {"stick", row.stick},
                 {"predictor", row.predictor}, {"used", row.used},        {"lead_s", row.lead_s},
                 {"rate_hz", row.rate_hz},     {"noise_mm", row.noise_mm}};
    put_error(json, row.error);
    json["ns_per_sample"] = if_any(row.ns_per_sample, row.ns_per_sample > 0);
    json["external"] = row.external;
    json["calibration"] = json_of(row.calibration);
    json["hits"] = json_of(row.hits);
    if (row.hits) json["hits"]["advance_ms"] = 1e3 * row.advance_s.value_or(0);
    return json;
}

Json json_of(const ComparisonSummary& summary) {
    Json json = {
        {"predictor", summary.predictor}, {"lead_s", summary.lead_s}, {"baseline", summary.baseline}};
    put_error(json, summary.error);
    json["ns_per_sample"] = if_any(summary.ns_per_sample, summary.ns_per_sample > 0);
    json["external"] = summary.external;
    json["calibration"] = json_of(summary.calibration);
    json["hits"] = json_of(summary.hits);
    if (summary.advance_s) {
        json["hits"]["advance_low_ms"] = 1e3 * summary.advance_s->first;
        json["hits"]["advance_high_ms"] = 1e3 * summary.advance_s->second;
    }
    return json;
}

Json json_of(const PairedResult& paired) {
    return {{"predictor", paired.predictor},
            {"baseline", paired.baseline},
            {"lead_s", paired.lead_s},
            {"rms_mm", paired.rms_mm},
            {"baseline_rms_mm", paired.baseline_rms_mm},
            {"by_recording", json_of(paired.by_recording)},
            {"by_person", paired.by_person ? json_of(*paired.by_person) : Json()}};
}

Json json_of(const MapCell& cell) {
    Json json = {{"rate_hz", cell.rate_hz},
                 {"noise_mm", cell.noise_mm},
                 {"jitter_ms", cell.jitter_ms},
                 {"drop_out", cell.drop_out}};
    json.update(json_of(cell.result));
    return json;
}

template <class Items>
Json array_of(const Items& items) {
    Json array = Json::array();
    for (const auto& item : items) array.push_back(json_of(item));
    return array;
}

Json settings_of(const Comparison& comparison) {
    const ComparisonOptions& o = comparison.options;
    Json predictors = Json::object();
    for (const auto& [name, description] : comparison.predictors) predictors[name] = description;
    return {
        {"traces", o.traces},
        {"persons", comparison.persons},
        {"predictors", predictors},
        {"leads_s", o.leads_s},
        {"rate_hz", if_any(o.sensor.rate_hz, o.sensor.rate_hz > 0)},
        {"noise_mm", 1e3 * o.sensor.noise_m},
        {"noise_rad", o.sensor.noise_rad},
        {"jitter_ms", 1e3 * o.sensor.jitter_s},
        {"true_stamps", o.sensor.true_stamps},
        {"drop_out", o.sensor.drop_out},
        {"burst", o.sensor.burst},
        {"latency_ms", 1e3 * o.sensor.latency_s},
        {"quantum_mm", 1e3 * o.sensor.quantum_m},
        {"quantum_rad", o.sensor.quantum_rad},
        {"outlier", o.sensor.outlier},
        {"outlier_radius_mm", 1e3 * o.sensor.outlier_m},
        {"duplicate", o.sensor.duplicate},
        {"late", o.sensor.late},
        {"seed", o.sensor.seed},
        {"tune", o.tune_traces},
        {"tuned", comparison.tuned_on},
        {"surface", o.surface_text},
        {"release_margin_s", o.release_margin_s},
        {"protocol",
         "samples at uniform times by linear interpolation plus noise; truth likewise at t + lead from the "
         "noiseless recording; first 0.5 s and gaps left out; free: truth not within 50 ms of impacts or "
         "flags"}};
}

}  // namespace

std::string format_comparison_json(const Comparison& comparison) {
    Json json = {{"settings", settings_of(comparison)},
                 {"results", array_of(comparison.rows)},
                 {"summary", array_of(comparison.summaries)},
                 {"paired", array_of(comparison.paired)},
                 {"winners", winners(comparison)},
                 {"winners_caution", selection_caution(comparison)}};
    if (comparison.options.map) json["map"] = array_of(comparison.map);
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace app
