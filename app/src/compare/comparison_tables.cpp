#include "compare/comparison_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <tuple>

#include "files/bad_input.h"
#include "report/json_document.h"

namespace app {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kHurtsMm = 10, kPoorF1 = 0.9;
constexpr const char* kProtocol =
    "samples at uniform times by linear interpolation plus noise; truth likewise at t + lead from the "
    "noiseless recording; first 0.5 s and gaps left out; free: truth not within 50 ms of impacts or flags";

/// A member of what may not be there.
template <class Whole, class Member>
Cell part_of(const std::optional<Whole>& whole, Member member) {
    return whole ? Cell(std::invoke(member, *whole)) : Cell();
}

using Figures = std::vector<Figure>;

Figures operator+(Figures a, const Figures& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

Figures scores_of(const PredictorScore& score) {
    const auto rms = [](const SquareSum& errors) { return errors.count > 0 ? Cell(errors.rms()) : Cell(); };
    const auto calibration = [&](auto member) { return part_of(score.calibration, member); };
    const auto hits = [&](auto member) { return part_of(score.hits, member); };
    return {{"rms_mm:.2f", rms(score.error.position)},
            {"p95_mm:.2f", score.error.p95_mm()},
            {"free_rms_mm:.2f", rms(score.error.free)},
            {"unflagged_rms_mm:.2f", rms(score.error.unflagged)},
            {"rotation_rms_deg:.2f", rms(score.error.rotation)},
            {"tip_rms_mm:.2f", rms(score.error.tip)},
            {"predictions:d", score.error.position.count},
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
            {"hits/speed_percent:.0f", hits(&HitScore::speed_percent)},
            {"hits/speed_db:.1f", hits(&HitScore::speed_db)},
            {"hits/speed_bias_db:+.1f", hits(&HitScore::speed_bias_db)},
            {"hits/place_mm:.1f", hits(&HitScore::place_mm)},
            {"hits/false_per_min:.2f", hits(&HitScore::false_per_min)},
            {"hits/false_per_min_without_cancel:.2f", hits(&HitScore::false_per_min_without_cancel)}};
}

Figures difference_of(const std::string& by, const std::optional<PairedDifference>& d) {
    const auto figure = [&](auto member) { return part_of(d, member); };
    const auto bound = [&](auto member) { return d && d->has_interval() ? part_of(d, member) : Cell(); };
    return {{by + "/n:d", figure(&PairedDifference::n)},
            {by + "/ratio:.3f", figure(&PairedDifference::ratio)},
            {by + "/low:.3f", bound(&PairedDifference::low)},
            {by + "/high:.3f", bound(&PairedDifference::high)},
            {by + "/difference_mm:+.2f", figure(&PairedDifference::difference_mm)},
            {by + "/difference_low_mm:+.2f", bound(&PairedDifference::difference_low_mm)},
            {by + "/difference_high_mm:+.2f", bound(&PairedDifference::difference_high_mm)},
            {by + "/verdict", figure(verdict)}};
}

Figures figures_of(const ComparisonRow& row) {
    return Figures{{"trace", row.trace},         {"person", row.person},      {"stick", row.stick},
                   {"predictor", row.predictor}, {"used", row.used},          {"lead_s", row.lead_s},
                   {"rate_hz:g", row.rate_hz},   {"noise_mm:g", row.noise_mm}} +
           scores_of(row) +
           Figures{{"hits/advance_ms:g", row.hits ? Cell(1e3 * row.advance_s.value_or(0)) : Cell()}};
}

Figures figures_of(const ComparisonSummary& summary) {
    const auto advance_ms = [&](auto member) {
        return summary.advance_s ? Cell(1e3 * std::invoke(member, *summary.advance_s)) : Cell();
    };
    return Figures{
               {"predictor", summary.predictor}, {"lead_s", summary.lead_s}, {"baseline", summary.baseline}} +
           scores_of(summary) +
           Figures{{"hits/advance_low_ms:g", advance_ms(&std::pair<double, double>::first)},
                   {"hits/advance_high_ms:g", advance_ms(&std::pair<double, double>::second)}};
}

Figures figures_of(const PairedResult& paired) {
    return Figures{{"predictor", paired.predictor},
                   {"baseline", paired.baseline},
                   {"lead_s", paired.lead_s},
                   {"rms_mm:.2f", paired.rms_mm},
                   {"baseline_rms_mm:.2f", paired.baseline_rms_mm}} +
           difference_of("by_recording", paired.by_recording) + difference_of("by_person", paired.by_person);
}

Figures figures_of(const MapCell& cell) {
    return Figures{{"rate_hz:g", cell.rate_hz},
                   {"noise_mm:g", cell.noise_mm},
                   {"jitter_ms:g", cell.jitter_ms},
                   {"drop_out:g", cell.drop_out}} +
           figures_of(cell.result);
}

/// What the columns of readers' tables mean, by their names as results have them.
constexpr std::pair<std::string_view, const char*> kMeanings[] = {
    {"rms_mm", "root of the mean squared error of the tracked point"},
    {"p95_mm", "95 % of the errors are below"},
    {"free_rms_mm", "RMS where the truth is not within 50 ms of an impact or a flagged time"},
    {"unflagged_rms_mm", "RMS not within 50 ms of a flagged time"},
    {"tip_rms_mm", "RMS at the stick's tip: of position and orientation"},
    {"rotation_rms_deg", "RMS angle between predicted and true orientation, degrees"},
    {"ns_per_sample", "time that a sample and its predictions take, nanoseconds"},
    {"hits/true", "contacts of the recorded path"},
    {"hits/predicted", "strikes that were fixed and not cancelled"},
    {"hits/matched", "of these, within 30 ms of a contact of their own"},
    {"hits/precision", "matched / predicted"},
    {"hits/recall", "matched / true"},
    {"hits/f1", "2 matched / (true + predicted)"},
    {"hits/median_ms", "half of the matched strikes err by less, in time"},
    {"hits/p95_ms", "95 % of them do"},
    {"hits/speed_percent", "half of them err by less, in the speed normal to the surface"},
    {"hits/speed_db", "the same in decibels"},
    {"hits/speed_bias_db", "median of predicted over true speed; positive: too loud"},
    {"hits/place_mm", "half of them err by less, in place along the surface"},
    {"hits/false_per_min", "predicted and not matched, a minute"},
    {"hits/false_per_min_without_cancel", "likewise if nothing were cancelled"},
    {"hits/advance_low_ms", "contacts were taken to come earlier by this, at least"},
    {"hits/advance_high_ms", "and at most"},
    {"calibration/count", "predictions with a stated covariance"},
    {"calibration/inside_50", "share of the errors within the region stated to hold 50 %"},
    {"calibration/inside_95", "likewise 95 %"},
    {"calibration/negative_log_likelihood", "of the errors, mean, nats with metres: less is better"},
    {"by_recording/verdict", "RMS against the baseline's; the interval is of resampled recordings"},
    {"by_person/verdict", "likewise of resampled persons"},
    {"by_recording/difference_mm", "RMS - the baseline's, and its interval, low to high"},
    {"jitter_ms", "standard deviation of the sampling times"},
    {"drop_out", "share of the samples lost"}};

/// Of those columns that stand in any of the tables.
std::string legend_of(const std::vector<Table>& tables, bool tuned) {
    Table legend = Table::of({"name", "meaning"});
    for (const auto& [name, meaning] : kMeanings)
        for (const Table& table : tables)
            if (const auto column = std::ranges::find(table.columns, name, &Column::name);
                column != table.columns.end()) {
                legend.add(
                    {table.headings()[static_cast<std::size_t>(column - table.columns.begin())], meaning});
                break;
            }
    if (!tuned) return legend.text();
    legend.add({"NAME*", "parameters that erred least on other recordings"});
    legend.add({"NAME**", "likewise on recordings of other persons"});
    return legend.text();
}

/// A row for each result.
template <class Result>
Table table_of(const std::vector<Result>& results) {
    Table table;
    for (const Result& result : results) table.add_figures(figures_of(result));
    return table;
}

/// Those at a lead.
template <class Result>
Table table_at(const std::vector<Result>& results, double lead_s) {
    Table table;
    for (const Result& result : results)
        if (result.lead_s == lead_s) table.add_figures(figures_of(result));
    return table;
}

/// Those of `cells` that `figures` have take their place; the others, but by person, come behind.
Figures with_map_cell(Figures figures, const Figures& cells, bool empty) {
    const std::size_t own = figures.size();
    for (Figure cell : cells) {
        const auto end = figures.begin() + static_cast<std::ptrdiff_t>(own);
        const auto same = std::find_if(figures.begin(), end,
                                       [&](const Figure& figure) { return figure.column == cell.column; });
        if (same != end && !empty) same->cell = cell.cell;
        if (same != end || cell.column.starts_with("by_person/")) continue;
        if (empty) cell.cell = Cell();
        figures.push_back(std::move(cell));
    }
    return figures;
}

Json summary_json(const Comparison& comparison) {
    Json rows = table_of(comparison.summaries).json();
    for (std::size_t i = 0; i < rows.size(); ++i)  // only where one was learned
        if (!comparison.summaries[i].advance_s && rows[i]["hits"].is_object())
            for (const char* key : {"advance_low_ms", "advance_high_ms"}) rows[i]["hits"].erase(key);
    return rows;
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
            {"transfer", o.transfer},
            {"tuned", comparison.tuned_on},
            {"surface", o.surface_text},
            {"estimators", comparison.estimators},
            {"release_margin_s", kReleaseMarginS},
            {"protocol", kProtocol}};
}

/// ". Of 292 true strikes auto commits best, F1 0.959, before ca (0.957)": the two best of one lead, and the
/// better of the baselines where neither is one.
std::string strike_winner(const Comparison& comparison, double lead_s) {
    const std::vector<const ComparisonSummary*> ranked = ranked_by_f1(comparison, lead_s);
    if (ranked.size() < 2) return {};
    const HitScore& best = *ranked[0]->hits;
    std::string text = fmt::format(
        ". Of {} true strikes {} commits best that far ahead: F1 {:.3f}, median error {:.1f} ms, {:.2f} "
        "false a minute; {} {} ({:.3f})",
        best.true_contacts, ranked[0]->predictor, best.f1(), best.median_ms(), best.false_per_min(),
        ranked[1]->hits->f1() == best.f1() ? "as good:" : "then", ranked[1]->predictor,
        ranked[1]->hits->f1());
    const auto baseline = std::ranges::find(ranked, true, &ComparisonSummary::baseline);
    if (baseline - ranked.begin() >= 2 && baseline != ranked.end())
        text += fmt::format("; the best baseline is {} ({:.3f})", (*baseline)->predictor,
                            (*baseline)->hits->f1());
    return text;
}

}  // namespace

Table result_table(const Comparison& comparison) {
    return table_of(comparison.rows);
}

Table csv_table(const Comparison& comparison) {
    if (comparison.map.empty()) return result_table(comparison);
    const Figures map_columns = figures_of(MapCell());
    Table table;
    for (const ComparisonRow& row : comparison.rows)
        table.add_figures(with_map_cell(figures_of(row), map_columns, true));
    for (const MapCell& cell : comparison.map) {
        Figures figures = figures_of(ComparisonRow());
        for (Figure& figure : figures) figure.cell = Cell();
        table.add_figures(with_map_cell(std::move(figures), figures_of(cell), false));
    }
    return table;
}

Table error_table(const Comparison& comparison, double lead_s) {
    return table_at(comparison.summaries, lead_s)
        .part({"predictor", "rms_mm", "p95_mm", "free_rms_mm", "unflagged_rms_mm", "tip_rms_mm",
               "rotation_rms_deg", "ns_per_sample"});
}

Table strike_table(const Comparison& comparison, double lead_s) {
    return table_at(comparison.summaries, lead_s)
        .part({"predictor", "hits/true", "hits/predicted", "hits/matched", "hits/precision", "hits/recall",
               "hits/f1", "hits/median_ms", "hits/p95_ms", "hits/speed_db", "hits/place_mm",
               "hits/false_per_min", "hits/false_per_min_without_cancel", "hits/advance_low_ms",
               "hits/advance_high_ms"});
}

Table calibration_table(const Comparison& comparison, double lead_s) {
    return table_at(comparison.summaries, lead_s)
        .part({"predictor", "calibration/count", "calibration/inside_50", "calibration/inside_95",
               "calibration/negative_log_likelihood"});
}

Table paired_table(const Comparison& comparison, double lead_s) {
    return table_at(comparison.paired, lead_s)
        .part({"predictor", "baseline", "by_recording/verdict", "by_person/verdict", "rms_mm",
               "baseline_rms_mm", "by_recording/difference_mm", "by_recording/difference_low_mm",
               "by_recording/difference_high_mm"});
}

Table map_table(const Comparison& comparison) {
    return table_of(best_cells(comparison.map))
        .part({"predictor", "baseline", "by_recording/verdict", "rate_hz", "noise_mm", "jitter_ms",
               "drop_out", "lead_s", "rms_mm", "baseline_rms_mm"});
}

Table how_far_table(const Comparison& comparison) {
    Table table = Table::of(
        {"predictor", "over_10_mm_from:.0f:ms", "over_20_mm_from:.0f:ms", "f1_below_0.9_from:.0f:ms"});
    const auto ms = [](const std::optional<double>& s) { return s ? Cell(1e3 * *s) : Cell(); };
    for (const LeadCurve& curve : comparison.curves)
        if (tells_how_far(curve.predictor))
            table.add({curve.predictor, ms(curve.passes(kHurtsMm)), ms(curve.passes(2 * kHurtsMm)),
                       ms(curve.falls_below(kPoorF1))});
    return table;
}

std::string how_far_sentence(const Comparison& comparison) {
    const auto from = [](const std::optional<double>& s) {
        if (!s) return std::string("nowhere up to 150 ms");
        return *s == 0 ? "at any lead" : fmt::format("from {:.0f} ms ahead on", 1e3 * *s);
    };
    std::string text;
    for (const LeadCurve& curve : comparison.curves)
        if (tells_how_far(curve.predictor))
            text += fmt::format("{}{} errs by more than {:g} mm {}, by more than {:g} mm {}",
                                text.empty() ? "" : "; ", curve.predictor, kHurtsMm,
                                from(curve.passes(kHurtsMm)), 2 * kHurtsMm, from(curve.passes(2 * kHurtsMm)));
    return text.empty() ? text : text + ".";
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

std::vector<const ComparisonSummary*> ranked_by_f1(const Comparison& comparison, double lead_s) {
    std::vector<const ComparisonSummary*> ranked;
    for (const ComparisonSummary& summary : comparison.summaries)
        if (summary.lead_s == lead_s && summary.hits && summary.hits->true_contacts > 0)
            ranked.push_back(&summary);
    std::ranges::stable_sort(ranked, std::greater(), [](const ComparisonSummary* summary) {
        // The nearer in time of equal ones; a tie in both is no win over a baseline.
        return std::tuple(summary->hits->f1(), summary->hits->matched > 0 ? -summary->hits->median_ms() : 0.0,
                          summary->baseline);
    });
    return ranked;
}

std::vector<std::string> winners(const Comparison& comparison) {
    std::vector<std::string> sentences;
    for (const double lead_s : comparison.options.leads_s) {
        const auto rank = [](const ComparisonSummary& summary) {
            return std::pair(summary.error.position.rms(), !summary.baseline);  // a tie is no win
        };
        const ComparisonSummary* best = nullptr;
        for (const ComparisonSummary& summary : comparison.summaries)
            if (summary.lead_s == lead_s && (best == nullptr || rank(summary) < rank(*best))) best = &summary;
        if (best == nullptr) continue;
        std::string text = fmt::format("{:.1f} ms ahead {} errs least, {:.1f} mm RMS", 1e3 * lead_s,
                                       best->predictor, best->error.position.rms());
        for (const PairedResult& paired : comparison.paired)
            if (paired.predictor == best->predictor && paired.lead_s == lead_s) {
                text += fmt::format("; the best baseline, {}, {:.1f} mm. Against it: {}", paired.baseline,
                                    paired.baseline_rms_mm, verdict(paired.by_recording));
                if (paired.by_person) text += fmt::format("; by person: {}", verdict(*paired.by_person));
            }
        if (best->baseline) text += ": a baseline, no filter does better";
        sentences.push_back(text + strike_winner(comparison, lead_s) + ".");
    }
    return sentences;
}

std::string selection_caution(const Comparison& comparison) {
    const std::string all = comparison.estimators == 1
                                ? "The interval holds at 95 %"
                                : fmt::format(
                                      "Intervals hold at 95 % for all {} estimators of a lead at once "
                                      "(Bonferroni), so for the best of them, too",
                                      comparison.estimators);
    return all + "; the best baseline is picked on the very recordings that are scored, which favours it.";
}

std::string map_sentence(const Comparison& comparison, double lead_s) {
    std::size_t sensors = 0;
    std::vector<double> gains;
    std::map<std::string, int> winners;
    for (const MapCell& cell : best_cells(comparison.map)) {
        if (cell.result.lead_s != lead_s) continue;
        ++sensors;
        if (!cell.result.by_recording.gain()) continue;
        gains.push_back(gain_percent(cell.result.by_recording.ratio));
        ++winners[cell.result.predictor];
    }
    if (sensors == 0) return {};
    std::set<std::pair<int, std::string>> by_count;
    for (const auto& [name, count] : winners) by_count.emplace(-count, name);
    std::string who;
    for (const auto& [count, name] : by_count)
        who += fmt::format("{}{} {}", who.empty() ? "" : ", ", name, -count);
    std::string text = fmt::format(
        "{:.1f} ms ahead the best estimator gains measurably over the best baseline in {} of {} sensors",
        1e3 * lead_s, gains.size(), sensors);
    if (!gains.empty()) text += fmt::format(", {:.1f} % in the median of these ({})", median(gains), who);
    return text + ".";
}

std::string format_comparison_json(const Comparison& comparison) {
    Json inputs = Json::array();
    for (const auto& [file, sha256] : comparison.inputs)
        inputs.push_back({{"file", file}, {"sha256", sha256}});
    const std::uint64_t seed = comparison.options.sensor.seed;
    Table curves = Table::of({"predictor", "lead_s", "rms_mm"});
    for (const LeadCurve& curve : comparison.curves)
        for (const auto& [lead_s, rms_mm] : curve.rms_mm) curves.add({curve.predictor, lead_s, rms_mm});
    Table strikes = Table::of({"predictor", "lead_s", "f1", "median_ms", "false_per_min"});
    for (const LeadCurve& curve : comparison.curves)
        for (const auto& [lead_s, hits] : curve.hits)
            strikes.add({curve.predictor, lead_s, hits.f1(), hits.median_ms(), hits.false_per_min()});
    Json json = {
        {"settings", settings_of(comparison)},
        {"results", result_table(comparison).json()},
        {"summary", summary_json(comparison)},
        {"paired", table_of(comparison.paired).json()},
        {"lead_curves", {{"errors", curves.json()}, {"strikes", strikes.json()}}},
        {"winners", winners(comparison)},
        {"winners_caution", selection_caution(comparison)},
        {"arguments", comparison.options.arguments},
        {"inputs", inputs},
        {"seeds", {{"sensor", seed}, {"intervals", seed}, {"training", comparison.options.training.seed}}},
        {"versions", {{"musicworld", MUSICWORLD_VERSION}}}};
    if (comparison.options.map) json["map"] = table_of(comparison.map).json();
    return json_document(json);
}

std::string format_comparison_text(const Comparison& comparison) {
    std::string text = fmt::format("{} of {}; {}\n", counted(comparison.options.traces.size(), "recording"),
                                   counted(comparison.persons.size(), "person"), comparison.tuned_on);
    std::vector<Table> shown;
    const bool tuned = std::ranges::any_of(comparison.predictors,
                                           [](const auto& named) { return named.first.ends_with('*'); });
    for (const double lead_s : comparison.options.leads_s) {
        text += fmt::format("\n{:.1f} ms ahead\n", 1e3 * lead_s);
        for (const auto& table : {error_table, strike_table, calibration_table, paired_table}) {
            Table rows = table(comparison, lead_s);
            if (rows.rows.empty()) continue;
            text += "\n" + rows.text();
            shown.push_back(std::move(rows));
        }
    }
    if (!comparison.map.empty()) {
        shown.push_back(map_table(comparison));
        text +=
            "\nWhere filters pay, each sensor and lead: the best estimator against the best baseline, tuned "
            "alike\n\n" +
            shown.back().text();
    }
    text += "\n" + legend_of(shown, tuned) + "\n";
    for (const double lead_s : comparison.options.leads_s)
        if (const std::string sentence = map_sentence(comparison, lead_s); !sentence.empty())
            text += sentence + "\n";
    for (const std::string& sentence : winners(comparison)) text += sentence + "\n";
    if (const std::string sentence = how_far_sentence(comparison); !sentence.empty())
        text += "How far ahead before it hurts? " + sentence + "\n";
    return text + selection_caution(comparison) + "\n";
}

}  // namespace app
