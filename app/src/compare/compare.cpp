#include "compare/compare.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "compare/comparison_figures.h"
#include "compare/comparison_map.h"
#include "compare/entrant_scores.h"
#include "compare/entrants.h"
#include "compare/prediction_error.h"
#include "compare/sensed_stick.h"
#include "files/bad_input.h"
#include "statistics/statistics.h"

namespace app {
namespace {

Field read_scored(const ComparisonOptions& options) {
    Field field = read_field(options.traces, options);
    const auto scored = [](const SensedStick& stick) {
        return std::any_of(stick.truths.begin(), stick.truths.end(),
                           [](const std::optional<Truth>& truth) { return truth.has_value(); });
    };
    if (std::none_of(field.sticks.begin(), field.sticks.end(), scored))
        throw BadInput(
            "error: found no sample whose prediction could be held against the recording (the first 0.5 s, "
            "gaps, and leads beyond the end do not count), expected some; give longer recordings, shorter "
            "leads or a faster sensor");
    return field;
}

void widen(std::optional<std::pair<double, double>>& range, double value) {
    if (!range) range = {value, value};
    range = {std::min(range->first, value), std::max(range->second, value)};
}

std::vector<ComparisonSummary> summarise(const Comparison& comparison, const std::vector<Entrant>& entrants) {
    std::vector<ComparisonSummary> summaries;
    for (const Entrant& entrant : entrants)
        for (const double lead_s : comparison.options.leads_s) {
            ComparisonSummary summary;
            summary.predictor = entrant.name;
            summary.lead_s = lead_s;
            summary.baseline = entrant.baseline;
            summary.external = entrant.external;
            std::vector<double> costs;
            for (const ComparisonRow& row : comparison.rows) {
                if (row.predictor != entrant.name || row.lead_s != lead_s) continue;
                add(summary.error, row.error);
                add(summary.calibration, row.calibration);
                if (row.hits && !summary.hits) summary.hits = HitScore{};
                if (row.hits) summary.hits->add(*row.hits);
                if (row.advance_s) widen(summary.advance_s, *row.advance_s);
                if (row.ns_per_sample > 0) costs.push_back(row.ns_per_sample);
            }
            summary.ns_per_sample = median(std::move(costs));
            if (summary.error.count > 0) summaries.push_back(std::move(summary));
        }
    return summaries;
}

std::vector<std::string> persons_of(const std::vector<Recording>& recordings) {
    std::vector<std::string> persons;
    for (const Recording& recording : recordings)
        if (std::find(persons.begin(), persons.end(), recording.person) == persons.end())
            persons.push_back(recording.person);
    return persons;
}

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

/// The baseline of least RMS on the sticks that `own` answers; none where there is no baseline.
std::optional<PairedResult> best_baseline(const RowIndex& index, const RowIndex::Sticks& own,
                                          const std::vector<Entrant>& entrants, const Entrant& entrant,
                                          double lead_s) {
    PairedResult result{entrant.name, "", lead_s, 0, 0, {}, {}};
    for (const Entrant& other : entrants) {
        if (!comparable(other, entrant)) continue;
        const double rms = rms_b(paired_sums(own, index.of(other.name, lead_s), &ComparisonRow::trace));
        if (result.baseline.empty() || rms < result.baseline_rms_mm)
            result.baseline = other.name, result.baseline_rms_mm = rms;
    }
    return result.baseline.empty() ? std::nullopt : std::optional(result);
}

/// Every estimator at every lead against the best baseline (PairedResult), on the recordings that the
/// estimator answers.
std::vector<PairedResult> pair_with_baselines(const Comparison& comparison,
                                              const std::vector<Entrant>& entrants) {
    const RowIndex index(comparison);
    const std::uint64_t seed = comparison.options.sensor.seed;
    std::vector<PairedResult> results;
    for (const Entrant& entrant : entrants)
        for (const double lead_s : comparison.options.leads_s) {
            const RowIndex::Sticks& own = index.of(entrant.name, lead_s);
            if (entrant.baseline || own.empty()) continue;
            std::optional<PairedResult> result = best_baseline(index, own, entrants, entrant, lead_s);
            if (!result) continue;
            const RowIndex::Sticks& base = index.of(result->baseline, lead_s);
            result->by_recording = paired_difference(paired_sums(own, base, &ComparisonRow::trace), seed);
            result->rms_mm = result->baseline_rms_mm + result->by_recording.difference_mm;
            if (const auto persons = paired_sums(own, base, &ComparisonRow::person); persons.size() >= 2)
                result->by_person = paired_difference(persons, seed);
            results.push_back(std::move(*result));
        }
    return results;
}

}  // namespace

Comparison compare(const ComparisonOptions& options) {
    Comparison comparison;
    comparison.options = options;
    const Field field = read_scored(options);
    comparison.persons = persons_of(field.recordings);
    const Field tuning = options.tuning ? read_field(options.tune_traces, options) : Field();
    const EntrantList list = enter(options, field, tuning);
    const std::vector<Entrant>& entrants = list.entrants;
    comparison.tuned_on = list.tuned_on;
    for (const Entrant& entrant : entrants)
        comparison.predictors.emplace_back(entrant.name, entrant.description);
    comparison.rows = score_entrants(field, tuning, entrants, options);
    comparison.summaries = summarise(comparison, entrants);
    comparison.paired = pair_with_baselines(comparison, entrants);
    comparison.curves = lead_curves(field.recordings, entrants, options);
    comparison.figure = stick_figure(field.recordings, field.sticks, entrants, comparison);
    if (options.map) comparison.map = map_sensors(field.recordings, options);
    return comparison;
}

}  // namespace app
