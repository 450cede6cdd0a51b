#include "compare/entrant_scores.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <span>

#include "compare/prediction_error.h"
#include "process/parallel.h"
#include "statistics/statistics.h"
#include "sticks/predictors.h"
#include "sticks/stick.h"

namespace app {
namespace {

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
    constexpr std::size_t kReach = 2, kUnchanged = 8;
    constexpr double kWorthwhile = 0.95;
    static_assert(advance_s(kUnchanged) == 0);
    const auto smoothed = [&](std::size_t k) {
        double sum = 0;
        for (std::size_t near = k - kReach; near <= k + kReach; ++near) sum += loss[near];
        return sum;
    };
    std::size_t best = kUnchanged;
    for (std::size_t k = kReach; k + kReach < kAdvances; ++k)
        if (smoothed(k) < smoothed(best)) best = k;
    return smoothed(best) < kWorthwhile * smoothed(kUnchanged) ? best : kUnchanged;
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
                     const Field& tuning, const std::vector<Entrant>& entrants,
                     const ComparisonOptions& options) {
    if (options.surface.kind == StrikeSurface::Kind::none || !options.tuning) return;
    if (tuning.recordings.empty() && field.recordings.size() < 2) return;
    const Field& others = tuning.recordings.empty() ? field : tuning;
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

constexpr std::size_t kCostPasses = 7, kMostTimedSamples = 4096;

/// Keeps the compiler from removing an unread result.
void keep(double value) {
    asm volatile("" : : "g"(value) : "memory");
}

/// Wall time of a sample: correct() and predict() at every lead, nothing else; the median over several passes
/// of a fresh predictor over the first samples. The only figure that differs between runs.
double nanoseconds_per_sample(const std::string& specification, std::span<const tracking::PoseSample> samples,
                              std::span<const double> leads_s) {
    const std::span<const tracking::PoseSample> timed =
        samples.first(std::min(samples.size(), kMostTimedSamples));
    std::vector<double> costs;
    for (std::size_t pass = 0; pass < kCostPasses; ++pass) {
        const auto predictor = make_any_predictor(specification, leads_s);
        const auto start = std::chrono::steady_clock::now();
        replay(*predictor, timed, [&](const ReplayedSample& now) {
            for (const double lead_s : leads_s) keep(predictor->predict(lead_s + now.behind_s).position.x());
        });
        const std::chrono::duration<double, std::nano> spent = std::chrono::steady_clock::now() - start;
        costs.push_back(spent.count() / static_cast<double>(timed.size()));
    }
    return median(std::move(costs));
}

/// A specification that runs at several leads of a pass is measured once.
void measure_costs(std::vector<ComparisonRow>& rows, const Field& field, std::size_t entrants) {
    const std::size_t leads = field.sticks.front().leads_s.size();
    for (std::size_t i = 0; i < rows.size(); ++i) {
        ComparisonRow& row = rows[i];
        if (row.external || row.used.empty()) continue;
        const auto same = [&](const ComparisonRow& other) { return other.used == row.used; };
        const auto own = rows.begin() + static_cast<std::ptrdiff_t>(i),
                   first = own - static_cast<std::ptrdiff_t>(i % leads);
        const SensedStick& stick = field.sticks[i / (entrants * leads)];
        if (const auto before = std::find_if(first, own, same); before != own)
            row.ns_per_sample = before->ns_per_sample;
        else
            row.ns_per_sample = nanoseconds_per_sample(row.used, stick.samples, stick.leads_s);
    }
}

}  // namespace

std::vector<ComparisonRow> score_entrants(const Field& field, const Field& tuning,
                                          const std::vector<Entrant>& entrants,
                                          const ComparisonOptions& options) {
    const Runs runs(field, entrants, options);
    std::vector<std::vector<ComparisonRow>> parts(runs.count());
    parallel_for(
        parts.size(), options.threads, [&](std::size_t i) { parts[i] = runs.rows(i); }, options.progress);
    advance_strikes(parts, runs, field, tuning, entrants, options);
    std::vector<ComparisonRow> rows;
    for (std::vector<ComparisonRow>& part : parts)
        for (ComparisonRow& row : part) rows.push_back(std::move(row));
    if (options.cost) measure_costs(rows, field, entrants.size());
    std::erase_if(rows, [](const ComparisonRow& row) { return row.used.empty(); });
    return rows;
}

}  // namespace app
