#include "compare/comparison_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>

#include "compare/comparison_map.h"
#include "compare/findings.h"

namespace app {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kProtocol =
    "samples at uniform times by linear interpolation plus noise; truth likewise at t + lead from the "
    "noiseless recording; first 0.5 s and gaps left out; free: truth not within 50 ms of impacts or flags";

/// A member of what may not be there.
template <class Whole, class Member>
Cell part_of(const std::optional<Whole>& whole, Member member) {
    return whole ? Cell(std::invoke(member, *whole)) : Cell();
}

void add_scores(std::vector<Figure>& row, const PredictorScore& score) {
    const ErrorScore& error = score.error;
    const auto calibration = [&](auto member) { return part_of(score.calibration, member); };
    const auto hits = [&](auto member) { return part_of(score.hits, member); };
    const std::vector<Figure> figures = {
        {"rms_mm:.2f", error.rms_mm},
        {"p95_mm:.2f", error.p95_mm},
        {"free_rms_mm:.2f", error.free_rms_mm},
        {"unflagged_rms_mm:.2f", error.unflagged_rms_mm},
        {"rotation_rms_deg:.2f", error.rotation_rms_deg},
        {"tip_rms_mm:.2f", error.tip_rms_mm},
        {"predictions:d", error.count},
        {"ns_per_sample:.0f", score.ns_per_sample},
        {"external", score.external, false},
        {"calibration/count:d", calibration(&Calibration::count), false},
        {"calibration/singular:d", calibration(&Calibration::singular), false},
        {"calibration/inside_50:.3f", calibration(&Calibration::inside_50)},
        {"calibration/inside_95:.3f", calibration(&Calibration::inside_95)},
        {"calibration/negative_log_likelihood:.2f", calibration(&Calibration::negative_log_likelihood)},
        {"hits/true:d", hits(&HitScore::true_contacts)},
        {"hits/predicted:d", hits(&HitScore::predicted)},
        {"hits/matched:d", hits(&HitScore::matched)},
        {"hits/precision:.3f", hits(&HitScore::precision)},
        {"hits/recall:.3f", hits(&HitScore::recall)},
        {"hits/f1:.3f", hits(&HitScore::f1)},
        {"hits/median_ms:.1f", hits(&HitScore::median_ms)},
        {"hits/p95_ms:.1f", hits(&HitScore::p95_ms)},
        {"hits/false_per_min:.2f", hits(&HitScore::false_per_min)},
        {"hits/false_per_min_without_cancel:.2f", hits(&HitScore::false_per_min_without_cancel)}};
    row.insert(row.end(), figures.begin(), figures.end());
}

void add_difference(std::vector<Figure>& row, const std::string& by,
                    const std::optional<PairedDifference>& d) {
    const auto figure = [&](auto member) { return part_of(d, member); };
    const auto bound = [&](auto member) { return d && d->has_interval() ? part_of(d, member) : Cell(); };
    const std::vector<Figure> figures = {
        {by + "/n:d", figure(&PairedDifference::n)},
        {by + "/ratio:.3f", figure(&PairedDifference::ratio)},
        {by + "/low:.3f", bound(&PairedDifference::low)},
        {by + "/high:.3f", bound(&PairedDifference::high)},
        {by + "/difference_mm:+.2f", figure(&PairedDifference::difference_mm)},
        {by + "/difference_low_mm:+.2f", bound(&PairedDifference::difference_low_mm)},
        {by + "/difference_high_mm:+.2f", bound(&PairedDifference::difference_high_mm)},
        {by + "/verdict", figure(verdict)}};
    row.insert(row.end(), figures.begin(), figures.end());
}

void add_pair(std::vector<Figure>& row, const PairedResult& paired) {
    const std::vector<Figure> figures = {{"predictor", paired.predictor},
                                         {"baseline", paired.baseline},
                                         {"lead_s", paired.lead_s},
                                         {"rms_mm:.2f", paired.rms_mm},
                                         {"baseline_rms_mm:.2f", paired.baseline_rms_mm}};
    row.insert(row.end(), figures.begin(), figures.end());
    add_difference(row, "by_recording", paired.by_recording);
    add_difference(row, "by_person", paired.by_person);
}

std::vector<Figure> figures_of(const ComparisonSummary& summary) {
    std::vector<Figure> row = {
        {"predictor", summary.predictor}, {"lead_s", summary.lead_s}, {"baseline", summary.baseline}};
    add_scores(row, summary);
    const auto advance_ms = [&](auto member) {
        return summary.advance_s ? Cell(1e3 * std::invoke(member, *summary.advance_s)) : Cell();
    };
    row.push_back({"hits/advance_low_ms:g", advance_ms(&std::pair<double, double>::first)});
    row.push_back({"hits/advance_high_ms:g", advance_ms(&std::pair<double, double>::second)});
    return row;
}

std::vector<Figure> figures_of(const MapCell& cell) {
    std::vector<Figure> row = {{"rate_hz:g", cell.rate_hz},
                               {"noise_mm:g", cell.noise_mm},
                               {"jitter_ms:g", cell.jitter_ms},
                               {"drop_out:g", cell.drop_out}};
    add_pair(row, cell.result);
    return row;
}

/// Of one lead.
Table summary_table(const Comparison& comparison, double lead_s) {
    Table table;
    for (const ComparisonSummary& summary : comparison.summaries)
        if (summary.lead_s == lead_s) table.add_figures(figures_of(summary));
    return table;
}

Json summary_json(const Comparison& comparison) {
    Table table;
    for (const ComparisonSummary& summary : comparison.summaries) table.add_figures(figures_of(summary));
    Json rows = table.json();
    for (std::size_t i = 0; i < rows.size(); ++i)  // only where one was learned
        if (!comparison.summaries[i].advance_s && rows[i]["hits"].is_object())
            for (const char* key : {"advance_low_ms", "advance_high_ms"}) rows[i]["hits"].erase(key);
    return rows;
}

Json paired_json(const Comparison& comparison) {
    Table table;
    for (const PairedResult& paired : comparison.paired) {
        std::vector<Figure> row;
        add_pair(row, paired);
        table.add_figures(row);
    }
    return table.json();
}

Json map_json(const Comparison& comparison) {
    Table table;
    for (const MapCell& cell : comparison.map) table.add_figures(figures_of(cell));
    return table.json();
}

Json settings_of(const Comparison& comparison) {
    const ComparisonOptions& o = comparison.options;
    Json predictors = Json::object();
    for (const auto& [name, description] : comparison.predictors) predictors[name] = description;
    return {{"traces", o.traces},
            {"persons", comparison.persons},
            {"predictors", predictors},
            {"leads_s", o.leads_s},
            {"rate_hz", o.sensor.rate_hz > 0 ? Json(o.sensor.rate_hz) : Json()},
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
            {"protocol", kProtocol}};
}

}  // namespace

Table result_table(const Comparison& comparison) {
    Table table;
    for (const ComparisonRow& result : comparison.rows) {
        std::vector<Figure> row = {{"trace", result.trace},       {"person", result.person},
                                   {"stick", result.stick},       {"predictor", result.predictor},
                                   {"used", result.used},         {"lead_s", result.lead_s},
                                   {"rate_hz:g", result.rate_hz}, {"noise_mm:g", result.noise_mm}};
        add_scores(row, result);
        row.push_back({"hits/advance_ms:g", result.hits ? Cell(1e3 * result.advance_s.value_or(0)) : Cell()});
        table.add_figures(row);
    }
    return table;
}

Table error_table(const Comparison& comparison, double lead_s) {
    return summary_table(comparison, lead_s)
        .part({"predictor", "rms_mm", "p95_mm", "free_rms_mm", "unflagged_rms_mm", "tip_rms_mm",
               "rotation_rms_deg", "ns_per_sample"});
}

Table strike_table(const Comparison& comparison, double lead_s) {
    return summary_table(comparison, lead_s)
        .part({"predictor", "hits/true", "hits/predicted", "hits/matched", "hits/precision", "hits/recall",
               "hits/f1", "hits/median_ms", "hits/p95_ms", "hits/false_per_min",
               "hits/false_per_min_without_cancel", "hits/advance_low_ms", "hits/advance_high_ms"});
}

Table calibration_table(const Comparison& comparison, double lead_s) {
    return summary_table(comparison, lead_s)
        .part({"predictor", "calibration/count", "calibration/inside_50", "calibration/inside_95",
               "calibration/negative_log_likelihood"});
}

Table paired_table(const Comparison& comparison, double lead_s) {
    Table table;
    for (const PairedResult& paired : comparison.paired) {
        if (paired.lead_s != lead_s) continue;
        std::vector<Figure> row;
        add_pair(row, paired);
        table.add_figures(row);
    }
    return table.part({"predictor", "baseline", "by_recording/verdict", "by_person/verdict", "rms_mm",
                       "baseline_rms_mm", "by_recording/difference_mm", "by_recording/difference_low_mm",
                       "by_recording/difference_high_mm"});
}

Table map_table(const Comparison& comparison) {
    Table table;
    for (const MapCell* cell : best_cells(comparison.map)) table.add_figures(figures_of(*cell));
    return table.part({"predictor", "baseline", "by_recording/verdict", "rate_hz", "noise_mm", "jitter_ms",
                       "drop_out", "lead_s", "rms_mm", "baseline_rms_mm"});
}

Table predictor_table(const Comparison& comparison) {
    Table table = Table::of({"predictor", "what it is", "what ran, and on how many sticks and leads"});
    for (const auto& [name, description] : comparison.predictors) {
        std::map<std::string, int> used;
        for (const ComparisonRow& row : comparison.rows)
            if (row.predictor == name) ++used[row.used];
        std::string ran;
        for (const auto& [specification, count] : used)
            ran += fmt::format("{}{} ({})", ran.empty() ? "" : "; ", specification, count);
        table.add({name, description, ran});
    }
    return table;
}

std::string format_comparison_json(const Comparison& comparison) {
    Json json = {{"settings", settings_of(comparison)}, {"results", result_table(comparison).json()},
                 {"summary", summary_json(comparison)}, {"paired", paired_json(comparison)},
                 {"winners", winners(comparison)},      {"winners_caution", selection_caution(comparison)}};
    if (comparison.options.map) json["map"] = map_json(comparison);
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string format_comparison_text(const Comparison& comparison) {
    const std::size_t recordings = comparison.options.traces.size(), persons = comparison.persons.size();
    std::string text =
        fmt::format("{} recording{} of {} person{}; {}\n", recordings, recordings == 1 ? "" : "s", persons,
                    persons == 1 ? "" : "s", comparison.tuned_on);
    for (const double lead_s : comparison.options.leads_s) {
        text += fmt::format("\n{:.1f} ms ahead\n", 1e3 * lead_s);
        for (const auto& table : {error_table, strike_table, calibration_table, paired_table})
            if (const std::string rows = table(comparison, lead_s).text(); !rows.empty()) text += "\n" + rows;
    }
    if (!comparison.map.empty())
        text +=
            "\nWhere filters pay, each sensor and lead: the best estimator against the best baseline, "
            "tuned alike\n\n" +
            map_table(comparison).text();
    for (const double lead_s : comparison.options.leads_s)
        if (const std::string sentence = map_sentence(comparison, lead_s); !sentence.empty())
            text += sentence + "\n";
    text += '\n';
    for (const std::string& sentence : winners(comparison)) text += sentence + "\n";
    return text + selection_caution(comparison) + "\n";
}

}  // namespace app
