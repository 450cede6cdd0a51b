#include "comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "bad_input.h"
#include "comparison_map.h"
#include "entrants.h"
#include "parallel.h"
#include "prediction_cost.h"
#include "prediction_error.h"
#include "predictors.h"
#include "stroke_lows.h"

namespace app {
namespace {

/// The recordings compared and what the sensor saw of them.
struct Field {
    std::vector<Recording> recordings;
    std::vector<SensedStick> sticks;
};

Field read_field(const ComparisonOptions& options) {
    Field field;
    for (const std::string& file : options.traces)
        field.recordings.push_back(read_recording(file, options.persons));
    field.sticks = sense_all(field.recordings, options.sensor, options.leads_s);
    return field;
}

HitScore hits_of(const Field& field, const SensedStick& stick, const std::string& specification,
                 const ComparisonOptions& options, double lead_s) {
    const Recording& recording = field.recordings[stick.recording];
    const std::array<double, 1> leads_s = {lead_s};
    const auto predictor = make_any_predictor(specification, leads_s);
    return evaluate_strikes(recording.trace.sticks[stick.stick], stick.samples, *predictor,
                            recording.geometry, options.surface, lead_s, options.release_margin_s);
}

/// The leads at which an entrant runs one specification, so that one pass serves them all.
std::vector<std::pair<std::string, std::vector<std::size_t>>> passes_of(
    const std::vector<std::string>& by_lead) {
    std::vector<std::pair<std::string, std::vector<std::size_t>>> passes;
    for (std::size_t lead = 0; lead < by_lead.size(); ++lead) {
        const auto same = std::find_if(passes.begin(), passes.end(),
                                       [&](const auto& pass) { return pass.first == by_lead[lead]; });
        if (same == passes.end())
            passes.push_back({by_lead[lead], {lead}});
        else
            same->second.push_back(lead);
    }
    return passes;
}

/// The rows of one entrant on one stick, a lead each.
std::vector<ComparisonRow> rows_of(const Field& field, const SensedStick& stick, const Entrant& entrant,
                                   const ComparisonOptions& options) {
    const Recording& recording = field.recordings[stick.recording];
    std::vector<ComparisonRow> rows(stick.leads_s.size());
    for (const auto& [specification, leads] : passes_of(entrant.used[stick.recording])) {
        const auto predictor = make_any_predictor(specification, stick.leads_s);
        const std::vector<LeadScore> scores = score_predictor(stick, *predictor);
        for (const std::size_t lead : leads) {
            ComparisonRow& row = rows[lead];
            row.trace = recording.file;
            row.person = recording.person;
            row.stick = recording.trace.sticks[stick.stick].name;
            row.predictor = entrant.name;
            row.used = specification;
            row.lead_s = stick.leads_s[lead];
            row.rate_hz = stick.rate_hz;
            row.noise_mm = 1e3 * options.sensor.noise_m;
            row.error = scores[lead].error;
            row.calibration = scores[lead].calibration;
            row.external = entrant.external;
            if (options.surface.kind != StrikeSurface::Kind::none)
                row.hits = hits_of(field, stick, specification, options, row.lead_s);
        }
    }
    return rows;
}

void measure_costs(std::vector<ComparisonRow>& rows, const Field& field, std::size_t entrants) {
    const std::size_t leads = field.sticks.front().leads_s.size();
    for (std::size_t i = 0; i < rows.size(); ++i) {
        ComparisonRow& row = rows[i];
        if (row.external) continue;
        const std::size_t lead = i % leads;
        for (std::size_t before = i - lead; before < i && row.ns_per_sample == 0; ++before)
            if (rows[before].used == row.used) row.ns_per_sample = rows[before].ns_per_sample;
        const SensedStick& stick = field.sticks[i / (entrants * leads)];
        if (row.ns_per_sample == 0)
            row.ns_per_sample = nanoseconds_per_sample(row.used, stick.samples, stick.leads_s);
    }
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
                if (row.ns_per_sample > 0) costs.push_back(row.ns_per_sample);
            }
            if (!costs.empty()) summary.ns_per_sample = quantile(std::move(costs), 0.5);
            summaries.push_back(std::move(summary));
        }
    return summaries;
}

const ComparisonSummary& summary_of(const Comparison& comparison, const std::string& predictor,
                                    double lead_s) {
    return *std::find_if(comparison.summaries.begin(), comparison.summaries.end(),
                         [&](const ComparisonSummary& summary) {
                             return summary.predictor == predictor && summary.lead_s == lead_s;
                         });
}

/// The squared errors of two predictors at a lead, grouped by recording or by person.
std::vector<PairedSums> paired_sums(const Comparison& comparison, const std::string& a, const std::string& b,
                                    double lead_s, std::string ComparisonRow::*group) {
    std::vector<std::string> names;
    std::vector<PairedSums> sums;
    for (const ComparisonRow& row : comparison.rows) {
        if (row.lead_s != lead_s || (row.predictor != a && row.predictor != b)) continue;
        const auto found = std::find(names.begin(), names.end(), row.*group);
        const std::size_t place = static_cast<std::size_t>(found - names.begin());
        if (found == names.end()) names.push_back(row.*group), sums.emplace_back();
        if (row.predictor == a) sums[place].sum_a += row.error.sum_square_mm2;
        if (row.predictor == a) sums[place].count += row.error.count;
        if (row.predictor == b) sums[place].sum_b += row.error.sum_square_mm2;
    }
    return sums;
}

/// Of the baselines that know as much as `entrant` does, the one of least RMS at a lead; nullptr: none.
const Entrant* best_baseline(const Comparison& comparison, const std::vector<Entrant>& entrants,
                             const Entrant& entrant, double lead_s) {
    const Entrant* best = nullptr;
    for (const Entrant& other : entrants) {
        const bool persons = entrant.tuning == Tuning::other_persons;
        if (!other.baseline || other.tuning == (persons ? Tuning::other_recordings : Tuning::other_persons))
            continue;
        if (best == nullptr || summary_of(comparison, other.name, lead_s).error.rms_mm <
                                   summary_of(comparison, best->name, lead_s).error.rms_mm)
            best = &other;
    }
    return best;
}

std::vector<PairedResult> pair_all(const Comparison& comparison, const std::vector<Entrant>& entrants) {
    std::vector<PairedResult> results;
    for (const Entrant& entrant : entrants)
        for (const double lead_s : comparison.options.leads_s) {
            const Entrant* baseline = best_baseline(comparison, entrants, entrant, lead_s);
            if (entrant.baseline || baseline == nullptr) continue;
            PairedResult result;
            result.predictor = entrant.name;
            result.baseline = baseline->name;
            result.lead_s = lead_s;
            result.rms_mm = summary_of(comparison, entrant.name, lead_s).error.rms_mm;
            result.baseline_rms_mm = summary_of(comparison, baseline->name, lead_s).error.rms_mm;
            const std::uint64_t seed = comparison.options.sensor.seed;
            result.by_recording = paired_difference(
                paired_sums(comparison, entrant.name, baseline->name, lead_s, &ComparisonRow::trace), seed);
            if (comparison.persons.size() >= 2)
                result.by_person = paired_difference(
                    paired_sums(comparison, entrant.name, baseline->name, lead_s, &ComparisonRow::person),
                    seed);
            results.push_back(std::move(result));
        }
    return results;
}

std::vector<std::string> persons_of(const std::vector<Recording>& recordings) {
    std::vector<std::string> persons;
    for (const Recording& recording : recordings)
        if (std::find(persons.begin(), persons.end(), recording.person) == persons.end())
            persons.push_back(recording.person);
    return persons;
}

}  // namespace

Comparison compare(const ComparisonOptions& options) {
    Comparison comparison;
    comparison.options = options;
    const Field field = read_field(options);
    comparison.persons = persons_of(field.recordings);
    const EntrantList list = enter(options, field.recordings, field.sticks);
    comparison.tuned_on = list.tuned_on;
    const std::vector<Entrant>& entrants = list.entrants;
    for (const Entrant& entrant : entrants)
        comparison.predictors.emplace_back(entrant.name, entrant.description);
    std::vector<std::vector<ComparisonRow>> parts(field.sticks.size() * entrants.size());
    parallel_for(
        parts.size(), options.threads,
        [&](std::size_t i) {
            parts[i] =
                rows_of(field, field.sticks[i / entrants.size()], entrants[i % entrants.size()], options);
        },
        options.progress);
    for (std::vector<ComparisonRow>& part : parts)
        for (ComparisonRow& row : part) comparison.rows.push_back(std::move(row));
    if (options.cost) measure_costs(comparison.rows, field, entrants.size());
    comparison.summaries = summarise(comparison, entrants);
    comparison.paired = pair_all(comparison, entrants);
    if (options.map) comparison.map = map_sensors(field.recordings, options);
    return comparison;
}

std::vector<std::string> winners(const Comparison& comparison) {
    std::vector<std::string> sentences;
    for (const double lead_s : comparison.options.leads_s) {
        const ComparisonSummary* best = nullptr;
        for (const ComparisonSummary& summary : comparison.summaries)
            if (summary.lead_s == lead_s && summary.error.count > 0 &&
                (best == nullptr || summary.error.rms_mm < best->error.rms_mm))
                best = &summary;
        if (best == nullptr) continue;
        std::string text = fmt::format("{:.1f} ms ahead {} errs least, {:.1f} mm RMS", 1e3 * lead_s,
                                       best->predictor, best->error.rms_mm);
        for (const PairedResult& paired : comparison.paired)
            if (paired.predictor == best->predictor && paired.lead_s == lead_s)
                text += fmt::format("; against the best baseline {} ({:.1f} mm): {}", paired.baseline,
                                    paired.baseline_rms_mm, verdict(paired.by_recording));
        if (best->baseline) text += ": a baseline, no filter does better";
        sentences.push_back(text + ".");
    }
    return sentences;
}

}  // namespace app
