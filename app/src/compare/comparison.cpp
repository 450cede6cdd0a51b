#include "compare/comparison.h"

#include <algorithm>
#include <map>

#include "compare/comparison_map.h"
#include "compare/entrant_scores.h"
#include "compare/entrants.h"
#include "files/bad_input.h"

namespace app {
namespace {

Field read_scored(const ComparisonOptions& options) {
    Field field = read_field(options.traces, options.persons, options.sensor, options.leads_s);
    const auto scored = [](const std::optional<Truth>& truth) { return truth.has_value(); };
    if (std::ranges::none_of(field.sticks, [&](const SensedStick& stick) {
            return std::ranges::any_of(stick.truths, scored);
        }))
        throw BadInput(
            "error: found no sample whose prediction could be held against the recording (the first 0.5 s, "
            "gaps, and leads beyond the end do not count), expected some; give longer recordings, shorter "
            "leads or a faster sensor");
    return field;
}

ComparisonSummary summary_of(const Entrant& entrant, double lead_s, const std::vector<ComparisonRow>& rows) {
    ComparisonSummary summary;
    summary.predictor = entrant.name;
    summary.lead_s = lead_s;
    summary.baseline = entrant.baseline;
    summary.external = entrant.external;
    std::vector<double> costs;
    for (const ComparisonRow& row : rows) {
        if (row.predictor != entrant.name || row.lead_s != lead_s) continue;
        summary.error.add(row.error);
        add(summary.calibration, row.calibration);
        if (row.hits && !summary.hits) summary.hits = HitScore{};
        if (row.hits) summary.hits->add(*row.hits);
        if (row.advance_s) {
            const auto [least, most] = summary.advance_s.value_or(std::pair(*row.advance_s, *row.advance_s));
            summary.advance_s = {std::min(least, *row.advance_s), std::max(most, *row.advance_s)};
        }
        if (row.ns_per_sample > 0) costs.push_back(row.ns_per_sample);
    }
    summary.ns_per_sample = median(std::move(costs));
    return summary;
}

/// Rows of one predictor at one lead, by trace and stick.
using StickRows = std::map<std::pair<std::string, std::string>, const ComparisonRow*>;

/// Squared errors of two predictors on the sticks that both answer, by recording or by person.
std::vector<PairedSums> paired_sums(const StickRows& a, const StickRows& b,
                                    std::string ComparisonRow::*group) {
    std::map<std::string, PairedSums> groups;
    for (const auto& [stick, row_a] : a)
        if (const auto row_b = b.find(stick); row_b != b.end())
            groups[row_a->*group].add({row_a->error.position, row_b->second->error.position});
    std::vector<PairedSums> all;
    for (const auto& [name, sums] : groups) all.push_back(sums);
    return all;
}

/// Whether a baseline knows as much as the estimator does.
bool comparable(const Entrant& baseline, const Entrant& estimator) {
    const bool persons = estimator.tuning == Tuning::other_persons;
    return baseline.baseline &&
           baseline.tuning != (persons ? Tuning::other_recordings : Tuning::other_persons);
}

/// Every estimator at every lead against the best baseline (PairedResult), on the recordings that the
/// estimator answers.
std::vector<PairedResult> pair_with_baselines(const Comparison& comparison,
                                              const std::vector<Entrant>& entrants) {
    std::map<std::pair<std::string, double>, StickRows> rows;
    for (const ComparisonRow& row : comparison.rows)
        rows[{row.predictor, row.lead_s}].emplace(std::pair{row.trace, row.stick}, &row);
    const std::uint64_t seed = comparison.options.sensor.seed;
    std::vector<PairedResult> results;
    for (const Entrant& entrant : entrants)
        for (const double lead_s : comparison.options.leads_s) {
            const StickRows& own = rows[{entrant.name, lead_s}];
            if (entrant.baseline || own.empty()) continue;
            PairedResult result{entrant.name, "", lead_s, 0, 0, {}, {}};
            for (const Entrant& other : entrants) {
                if (!comparable(other, entrant)) continue;
                SquareSum errors;
                for (const PairedSums& sums :
                     paired_sums(own, rows[{other.name, lead_s}], &ComparisonRow::trace))
                    errors.add(sums.b);
                if (result.baseline.empty() || errors.rms() < result.baseline_rms_mm)
                    result.baseline = other.name, result.baseline_rms_mm = errors.rms();
            }
            if (result.baseline.empty()) continue;
            const StickRows& base = rows[{result.baseline, lead_s}];
            result.by_recording = paired_difference(paired_sums(own, base, &ComparisonRow::trace), seed);
            result.rms_mm = result.baseline_rms_mm + result.by_recording.difference_mm;
            if (const auto persons = paired_sums(own, base, &ComparisonRow::person); persons.size() >= 2)
                result.by_person = paired_difference(persons, seed);
            results.push_back(std::move(result));
        }
    return results;
}

}  // namespace

Comparison compare(const ComparisonOptions& options) {
    Comparison comparison;
    comparison.options = options;
    const Field field = read_scored(options);
    for (const Recording& recording : field.recordings)
        if (std::ranges::find(comparison.persons, recording.person) == comparison.persons.end())
            comparison.persons.push_back(recording.person);
    const Field tuning =
        options.tuning ? read_field(options.tune_traces, options.persons, options.sensor, options.leads_s)
                       : Field();
    const EntrantList list = enter(options, field, tuning);
    comparison.tuned_on = list.tuned_on;
    comparison.rows = score_entrants(field, tuning, list.entrants, options);
    for (const Entrant& entrant : list.entrants) {
        comparison.predictors.emplace_back(entrant.name, entrant.description);
        for (const double lead_s : options.leads_s)
            if (ComparisonSummary summary = summary_of(entrant, lead_s, comparison.rows);
                summary.error.position.count > 0)
                comparison.summaries.push_back(std::move(summary));
    }
    comparison.paired = pair_with_baselines(comparison, list.entrants);
    comparison.curves = lead_curves(field.recordings, list.entrants, options);
    comparison.figure = stick_figure(field, list.entrants, comparison);
    if (options.map) comparison.map = map_sensors(field.recordings, options);
    return comparison;
}

}  // namespace app
