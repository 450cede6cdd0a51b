#include "compare/findings.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "compare/comparison_map.h"
#include "statistics/statistics.h"

namespace app {
namespace {

/// ". Of 292 true strikes auto commits best, F1 0.959, before ca (0.957)": the two best of one lead, and the
/// better of the baselines where neither is one.
std::string strike_winner(const Comparison& comparison, double lead_s) {
    std::vector<const ComparisonSummary*> ranked;
    for (const ComparisonSummary& summary : comparison.summaries)
        if (summary.lead_s == lead_s && summary.hits && summary.hits->true_contacts > 0)
            ranked.push_back(&summary);
    if (ranked.size() < 2) return {};
    std::stable_sort(
        ranked.begin(), ranked.end(),
        [](const ComparisonSummary* a, const ComparisonSummary* b) { return a->hits->f1() > b->hits->f1(); });
    const HitScore& best = *ranked[0]->hits;
    std::string text = fmt::format(
        ". Of {} true strikes {} commits best that far ahead: F1 {:.3f}, median error {:.1f} ms, {:.2f} "
        "false a minute; then {} ({:.3f})",
        best.true_contacts, ranked[0]->predictor, best.f1(), best.median_ms(), best.false_per_min(),
        ranked[1]->predictor, ranked[1]->hits->f1());
    const auto baseline =
        std::find_if(ranked.begin(), ranked.end(), [](const ComparisonSummary* s) { return s->baseline; });
    if (baseline - ranked.begin() >= 2 && baseline != ranked.end())
        text += fmt::format("; the best baseline is {} ({:.3f})", (*baseline)->predictor,
                            (*baseline)->hits->f1());
    return text;
}

}  // namespace

std::vector<std::string> winners(const Comparison& comparison) {
    std::vector<std::string> sentences;
    for (const double lead_s : comparison.options.leads_s) {
        const ComparisonSummary* best = nullptr;
        for (const ComparisonSummary& summary : comparison.summaries)
            if (summary.lead_s == lead_s && (best == nullptr || summary.error.rms_mm < best->error.rms_mm))
                best = &summary;
        if (best == nullptr) continue;
        std::string text = fmt::format("{:.1f} ms ahead {} errs least, {:.1f} mm RMS", 1e3 * lead_s,
                                       best->predictor, best->error.rms_mm);
        for (const PairedResult& paired : comparison.paired)
            if (paired.predictor == best->predictor && paired.lead_s == lead_s) {
                text += fmt::format("; against the best baseline {} ({:.1f} mm): {}", paired.baseline,
                                    paired.baseline_rms_mm, verdict(paired.by_recording));
                if (paired.by_person) text += fmt::format("; by person: {}", verdict(*paired.by_person));
            }
        if (best->baseline) text += ": a baseline, no filter does better";
        sentences.push_back(text + strike_winner(comparison, lead_s) + ".");
    }
    return sentences;
}

std::string selection_caution(const Comparison& comparison) {
    return fmt::format(
        "These are the best of {} entrants, picked on the very recordings that they are scored on: the "
        "intervals do not correct for that choice.",
        comparison.predictors.size());
}

std::string map_sentence(const Comparison& comparison, double lead_s) {
    std::size_t sensors = 0;
    std::vector<double> gains;
    std::map<std::string, int> winners;
    for (const MapCell* cell : best_cells(comparison.map)) {
        if (cell->result.lead_s != lead_s) continue;
        ++sensors;
        if (!cell->result.by_recording.gain()) continue;
        gains.push_back(gain_percent(cell->result.by_recording.ratio));
        ++winners[cell->result.predictor];
    }
    if (sensors == 0) return {};
    std::vector<std::pair<int, std::string>> by_count;
    for (const auto& [name, count] : winners) by_count.emplace_back(-count, name);
    std::sort(by_count.begin(), by_count.end());
    std::string who;
    for (const auto& [count, name] : by_count)
        who += fmt::format("{}{} {}", who.empty() ? "" : ", ", name, -count);
    std::string text = fmt::format(
        "{:.1f} ms ahead the best estimator gains measurably over the best baseline "
        "in {} of {} sensors",
        1e3 * lead_s, gains.size(), sensors);
    if (!gains.empty()) text += fmt::format(", {:.1f} % in the median of these ({})", median(gains), who);
    return text + ".";
}

}  // namespace app
