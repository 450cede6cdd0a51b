#include "compare/comparison.h"

#include <algorithm>
#include <array>
#include <span>

#include "compare/comparison_figures.h"
#include "compare/comparison_map.h"
#include "compare/comparison_pairs.h"
#include "compare/entrants.h"
#include "compare/prediction_cost.h"
#include "compare/prediction_error.h"
#include "files/bad_input.h"
#include "process/parallel.h"
#include "statistics/statistics.h"
#include "sticks/predictors.h"
#include "sticks/stick_tracker.h"
#include "strikes/stroke_lows.h"

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

/// The leads that one predictor serves in one pass: those for which the same specification runs.
std::vector<std::vector<std::size_t>> passes_of(const Entrant& entrant, std::size_t recording) {
    const std::vector<std::string>& used = entrant.used[recording];
    std::vector<std::vector<std::size_t>> passes;
    for (std::size_t lead = 0; lead < used.size(); ++lead) {
        if (used[lead].empty()) continue;
        const auto same = std::find_if(passes.begin(), passes.end(),
                                       [&](const auto& pass) { return used[pass.front()] == used[lead]; });
        if (same == passes.end() || !entrant.replays.empty())
            passes.push_back({lead});
        else
            same->push_back(lead);
    }
    return passes;
}

/// Runs entrants over the sticks of a field.
class Runs {
public:
    Runs(const Field& field, const std::vector<Entrant>& entrants, const ComparisonOptions& options)
        : field_(field), entrants_(entrants), options_(options) {}

    [[nodiscard]] std::size_t count() const { return field_.sticks.size() * entrants_.size(); }

    /// The rows of run `index`, a lead each; those without predictions have no `used`.
    [[nodiscard]] std::vector<ComparisonRow> rows(std::size_t index) const {
        const std::size_t place = index / entrants_.size();
        const SensedStick& stick = field_.sticks[place];
        const Entrant& entrant = entrants_[index % entrants_.size()];
        std::vector<ComparisonRow> rows(stick.leads_s.size());
        for (const std::vector<std::size_t>& pass : passes_of(entrant, stick.recording)) {
            const auto predictor = make_entrant(entrant, stick, place, pass.front());
            const std::vector<LeadScore> scores = score_predictor(stick, *predictor);
            for (const std::size_t lead : pass) {
                rows[lead] = labelled(stick, entrant, lead);
                rows[lead].error = scores[lead].error;
                rows[lead].calibration = scores[lead].calibration;
                if (options_.surface.kind != StrikeSurface::Kind::none)
                    rows[lead].hits = hits(place, index % entrants_.size(), lead, 0);
            }
        }
        return rows;
    }

    [[nodiscard]] HitScore hits(std::size_t place, std::size_t entrant_index, std::size_t lead,
                                double advance_s) const {
        const SensedStick& stick = field_.sticks[place];
        const Entrant& entrant = entrants_[entrant_index];
        const Recording& recording = field_.recordings[stick.recording];
        const StrikeTiming when{stick.leads_s[lead], options_.release_margin_s, advance_s};
        const auto timing = make_striker(entrant, stick, place, lead, strike_leads(when));
        std::unique_ptr<tracking::Predictor> confirming;
        if (!entrant.confirmed_by.empty())
            confirming = make_any_predictor(entrant.confirmed_by, path_leads(kConfirmingLeadS), stick.name);
        return evaluate_strikes(recording.trace.sticks[stick.stick], stick.samples,
                                {*timing, confirming.get()}, recording.geometry, options_.surface, when);
    }

private:
    [[nodiscard]] ComparisonRow labelled(const SensedStick& stick, const Entrant& entrant,
                                         std::size_t lead) const {
        const Recording& recording = field_.recordings[stick.recording];
        ComparisonRow row;
        row.trace = recording.file;
        row.person = recording.person;
        row.stick = stick.name;
        row.predictor = entrant.name;
        row.used = entrant.used[stick.recording][lead];
        row.lead_s = stick.leads_s[lead];
        row.rate_hz = stick.rate_hz;
        row.noise_mm = 1e3 * options_.sensor.noise_m;
        row.external = entrant.external;
        return row;
    }

    const Field& field_;
    const std::vector<Entrant>& entrants_;
    const ComparisonOptions& options_;
};

/// Advances that learning tries: -8 to 14 ms.
constexpr std::size_t kAdvances = 23;
constexpr double advance_s(std::size_t k) {
    return 1e-3 * (static_cast<double>(k) - 8);
}

/// The advance whose loss, averaged with those up to 2 ms off, is least: single notes that match or just miss
/// decide nothing. None if that saves less than 5 % against none.
std::size_t least_smoothed(std::span<const double, kAdvances> loss) {
    constexpr std::size_t kReach = 2, kNone = 8;
    constexpr double kWorthwhile = 0.95;
    static_assert(advance_s(kNone) == 0);
    const auto smoothed = [&](std::size_t k) {
        double sum = 0;
        for (std::size_t near = k - kReach; near <= k + kReach; ++near) sum += loss[near];
        return sum;
    };
    std::size_t best = kNone;
    for (std::size_t k = kReach; k + kReach < kAdvances; ++k)
        if (smoothed(k) < smoothed(best)) best = k;
    return smoothed(best) < kWorthwhile * smoothed(kNone) ? best : kNone;
}

/// What the strikes of one entrant cost on recordings, by advance.
class AdvanceLosses {
public:
    AdvanceLosses(const Field& field, const Entrant& entrant, const ComparisonOptions& options)
        : field_(field), leads_(options.leads_s.size()), losses_(field.sticks.size() * leads_) {
        // The same specification runs on every recording.
        std::vector<Entrant> alone = {entrant};
        alone[0].used.assign(field.recordings.size(), entrant.used.front());
        const Runs runs(field, alone, options);
        parallel_for(losses_.size(), options.threads, [&](std::size_t i) {
            for (std::size_t k = 0; k < kAdvances; ++k)
                losses_[i][k] = runs.hits(i / leads_, 0, i % leads_, advance_s(k)).loss();
        });
    }

    /// The advance of least cost at a lead, on the recordings but `scored`; none where there are no others.
    [[nodiscard]] std::optional<double> best_s(const Recording& scored, std::size_t lead) const {
        std::array<double, kAdvances> loss{};
        bool any = false;
        for (std::size_t place = 0; place < field_.sticks.size(); ++place) {
            if (same_samples(field_.recordings[field_.sticks[place].recording], scored)) continue;
            any = true;
            for (std::size_t k = 0; k < kAdvances; ++k) loss[k] += losses_[place * leads_ + lead][k];
        }
        return any ? std::optional(advance_s(least_smoothed(loss))) : std::nullopt;
    }

private:
    const Field& field_;
    std::size_t leads_;
    std::vector<std::array<double, kAdvances>> losses_;  // by stick and lead
};

/// Scores the strikes of the entrants that learn an advance again: contacts are taken to come earlier by what
/// costs least (HitScore::loss) at that lead on the `--tune` recordings, or on all others compared, never on
/// the one that is scored.
void advance_strikes(std::vector<std::vector<ComparisonRow>>& parts, const Runs& runs, const Field& field,
                     const std::vector<Entrant>& entrants, const ComparisonOptions& options) {
    const auto learns = [](const Entrant& entrant) { return entrant.learns_advance; };
    if (options.surface.kind == StrikeSurface::Kind::none || !options.tuning ||
        std::none_of(entrants.begin(), entrants.end(), learns))
        return;
    const Field own = read_field(options.tune_traces, options);
    const Field& others = options.tune_traces.empty() ? field : own;
    if (&others == &field && field.recordings.size() < 2) return;
    const std::size_t leads = options.leads_s.size();
    for (std::size_t entrant = 0; entrant < entrants.size(); ++entrant) {
        if (!entrants[entrant].learns_advance) continue;
        const AdvanceLosses losses(others, entrants[entrant], options);
        parallel_for(field.sticks.size() * leads, options.threads, [&](std::size_t i) {
            const std::size_t place = i / leads, lead = i % leads;
            ComparisonRow& row = parts[place * entrants.size() + entrant][lead];
            row.advance_s = losses.best_s(field.recordings[field.sticks[place].recording], lead);
            if (row.advance_s) row.hits = runs.hits(place, entrant, lead, *row.advance_s);
        });
    }
}

void measure_costs(std::vector<ComparisonRow>& rows, const Field& field, std::size_t entrants) {
    const std::size_t leads = field.sticks.front().leads_s.size();
    for (std::size_t i = 0; i < rows.size(); ++i) {
        ComparisonRow& row = rows[i];
        if (row.external || row.used.empty()) continue;
        const std::size_t lead = i % leads;
        for (std::size_t before = i - lead; before < i && row.ns_per_sample == 0; ++before)
            if (rows[before].used == row.used) row.ns_per_sample = rows[before].ns_per_sample;
        const SensedStick& stick = field.sticks[i / (entrants * leads)];
        if (row.ns_per_sample == 0)
            row.ns_per_sample = nanoseconds_per_sample(row.used, stick.samples, stick.leads_s);
    }
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
            if (!costs.empty()) summary.ns_per_sample = quantile(std::move(costs), 0.5);
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

}  // namespace

Comparison compare(const ComparisonOptions& options) {
    Comparison comparison;
    comparison.options = options;
    const Field field = read_scored(options);
    comparison.persons = persons_of(field.recordings);
    const EntrantList list = enter(options, field.recordings, field.sticks);
    comparison.tuned_on = list.tuned_on;
    const std::vector<Entrant>& entrants = list.entrants;
    for (const Entrant& entrant : entrants)
        comparison.predictors.emplace_back(entrant.name, entrant.description);
    const Runs runs(field, entrants, options);
    std::vector<std::vector<ComparisonRow>> parts(runs.count());
    parallel_for(
        parts.size(), options.threads, [&](std::size_t i) { parts[i] = runs.rows(i); }, options.progress);
    advance_strikes(parts, runs, field, entrants, options);
    for (std::vector<ComparisonRow>& part : parts)
        for (ComparisonRow& row : part) comparison.rows.push_back(std::move(row));
    if (options.cost) measure_costs(comparison.rows, field, entrants.size());
    std::erase_if(comparison.rows, [](const ComparisonRow& row) { return row.used.empty(); });
    comparison.summaries = summarise(comparison, entrants);
    comparison.paired = pair_with_baselines(comparison, entrants);
    comparison.curves = lead_curves(field.recordings, entrants, options);
    comparison.figure = stick_figure(field.recordings, field.sticks, entrants, comparison);
    if (options.map) comparison.map = map_sensors(field.recordings, options);
    return comparison;
}

}  // namespace app
