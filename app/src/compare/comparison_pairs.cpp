#include "compare/comparison_pairs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "statistics/statistics.h"

namespace app {
namespace {

/// Rows of a comparison by predictor, lead and stick.
class RowIndex {
public:
    explicit RowIndex(const Comparison& comparison) {
        for (const ComparisonRow& row : comparison.rows)
            rows_[{row.predictor, row.lead_s}].emplace(std::pair{row.trace, row.stick}, &row);
    }

    using Sticks = std::map<std::pair<std::string, std::string>, const ComparisonRow*>;
    [[nodiscard]] const Sticks& of(const std::string& predictor, double lead_s) const {
        static const Sticks none;
        const auto found = rows_.find({predictor, lead_s});
        return found == rows_.end() ? none : found->second;
    }

private:
    std::map<std::pair<std::string, double>, Sticks> rows_;
};

/// Squared errors of two predictors on the sticks that both answer, by recording or by person.
std::vector<PairedSums> paired_sums(const RowIndex::Sticks& a, const RowIndex::Sticks& b,
                                    std::string ComparisonRow::*group) {
    std::map<std::string, PairedSums> groups;
    for (const auto& [stick, row_a] : a) {
        const auto row_b = b.find(stick);
        if (row_b == b.end()) continue;
        PairedSums& sums = groups[row_a->*group];
        sums.sum_a += row_a->error.sum_square_mm2;
        sums.sum_b += row_b->second->error.sum_square_mm2;
        sums.count += row_a->error.count;
    }
    std::vector<PairedSums> all;
    for (const auto& [name, sums] : groups) all.push_back(sums);
    return all;
}

double rms_b(const std::vector<PairedSums>& groups) {
    double sum = 0, count = 0;
    for (const PairedSums& group : groups) sum += group.sum_b, count += static_cast<double>(group.count);
    return count > 0 ? std::sqrt(sum / count) : 0;
}

/// Whether a baseline knows as much as the estimator does.
bool comparable(const Entrant& baseline, const Entrant& estimator) {
    const bool persons = estimator.tuning == Tuning::other_persons;
    return baseline.baseline &&
           baseline.tuning != (persons ? Tuning::other_recordings : Tuning::other_persons);
}

/// "; of 292 true strikes auto commits best, F1 0.959, before ca (0.957)": the two best of one lead, and the
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

std::vector<PairedResult> pair_with_baselines(const Comparison& comparison,
                                              const std::vector<Entrant>& entrants) {
    const RowIndex index(comparison);
    const std::uint64_t seed = comparison.options.sensor.seed;
    std::vector<PairedResult> results;
    for (const Entrant& entrant : entrants)
        for (const double lead_s : comparison.options.leads_s) {
            const RowIndex::Sticks& own = index.of(entrant.name, lead_s);
            if (entrant.baseline || own.empty()) continue;
            PairedResult result{entrant.name, "", lead_s, 0, 0, {}, {}};
            for (const Entrant& other : entrants) {
                if (!comparable(other, entrant)) continue;
                const double rms =
                    rms_b(paired_sums(own, index.of(other.name, lead_s), &ComparisonRow::trace));
                if (result.baseline.empty() || rms < result.baseline_rms_mm)
                    result.baseline = other.name, result.baseline_rms_mm = rms;
            }
            if (result.baseline.empty()) continue;
            const RowIndex::Sticks& base = index.of(result.baseline, lead_s);
            result.by_recording = paired_difference(paired_sums(own, base, &ComparisonRow::trace), seed);
            result.rms_mm = result.baseline_rms_mm + result.by_recording.difference_mm;
            if (const auto persons = paired_sums(own, base, &ComparisonRow::person); persons.size() >= 2)
                result.by_person = paired_difference(persons, seed);
            results.push_back(std::move(result));
        }
    return results;
}

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

}  // namespace app
