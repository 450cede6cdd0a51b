#include "compare/entrant_scores.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <iterator>
#include <span>

#include "process/parallel.h"
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
        const auto same =
            std::ranges::find_if(passes, [&](const auto& pass) { return used[pass.front()] == used[lead]; });
        if (same == passes.end() || !entrant.replays.empty())
            passes.push_back({lead});
        else
            same->push_back(lead);
    }
    return passes;
}

/// A fresh predictor at a lead at which `used` is not empty; `leads_s` will be asked for. `instead`: the
/// specification that runs unless it is empty or a file answers.
std::unique_ptr<tracking::Predictor> make_entrant(const Entrant& entrant, const SensedStick& stick,
                                                  std::size_t lead, std::span<const double> leads_s,
                                                  const std::string& instead = {}) {
    if (const auto replay = entrant.replays.find({stick.number, lead}); replay != entrant.replays.end())
        return make_replay(replay->second);
    return make_any_predictor(instead.empty() ? entrant.used[stick.recording][lead] : instead, leads_s,
                              stick.name);
}

HitScore hits_of(const Entrant& entrant, const Field& field, const SensedStick& stick, std::size_t lead,
                 const ComparisonOptions& options, double advance_s) {
    const Recording& recording = field.recordings[stick.recording];
    const StrikeTiming when{stick.leads_s[lead], advance_s};
    const auto timing = make_entrant(entrant, stick, lead, strike_leads(when), entrant.strikes_by);
    std::unique_ptr<tracking::Predictor> confirming;
    if (!entrant.confirmed_by.empty())
        confirming = make_any_predictor(entrant.confirmed_by, path_leads(kConfirmingLeadS), stick.name);
    return evaluate_strikes(recording.trace.sticks[stick.stick], stick.samples, {*timing, confirming.get()},
                            recording.geometry, options.surface, when);
}

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

/// Learns by how much the contacts of an entrant come earlier: by what costs least (HitScore::loss) at a lead.
class AdvanceLosses {
public:
    /// Of `auto`, the one entrant that learns; it runs the same on every recording.
    AdvanceLosses(const Field& field, const Entrant& entrant, const ComparisonOptions& options)
        : field_(field), leads_(options.leads_s.size()), losses_(field.sticks.size() * leads_) {
        parallel_for(losses_.size(), options.threads, [&](std::size_t i) {
            for (std::size_t k = 0; k < kAdvances; ++k)
                losses_[i][k] =
                    hits_of(entrant, field, field.sticks[i / leads_], i % leads_, options, advance_s(k))
                        .loss();
        });
    }

    /// On the recordings but `scored`; none where there are no others.
    [[nodiscard]] std::optional<double> best_s(const Recording& scored, std::size_t lead) const {
        std::array<double, kAdvances> loss{};
        bool any = false;
        for (const SensedStick& stick : field_.sticks) {
            if (same_samples(field_.recordings[stick.recording], scored)) continue;
            any = true;
            for (std::size_t k = 0; k < kAdvances; ++k) loss[k] += losses_[stick.number * leads_ + lead][k];
        }
        return any ? std::optional(advance_s(least_smoothed(loss))) : std::nullopt;
    }

private:
    const Field& field_;
    std::size_t leads_;
    std::vector<std::array<double, kAdvances>> losses_;  // by stick and lead
};

constexpr std::size_t kCostPasses = 7, kMostTimedSamples = 4096;

/// Keeps the compiler from removing an unread result.
void keep(double value) {
    asm volatile("" : : "g"(value) : "memory");
}

/// Wall time of a sample: correct() and predict() at every lead, nothing else; the median over several passes
/// of a fresh predictor over the first samples. The only figure that differs between runs.
double nanoseconds_per_sample(const std::string& specification, const SensedStick& stick) {
    const std::span timed = std::span(stick.samples).first(std::min(stick.samples.size(), kMostTimedSamples));
    std::vector<double> costs;
    for (std::size_t pass = 0; pass < kCostPasses; ++pass) {
        const auto predictor = make_any_predictor(specification, stick.leads_s);
        const auto start = std::chrono::steady_clock::now();
        replay(*predictor, timed, [&](const ReplayedSample& now) {
            for (const double lead_s : stick.leads_s)
                keep(predictor->predict(lead_s + now.behind_s).position.x());
        });
        const std::chrono::duration<double, std::nano> spent = std::chrono::steady_clock::now() - start;
        costs.push_back(spent.count() / static_cast<double>(timed.size()));
    }
    return median(std::move(costs));
}

/// The rows of one entrant on one stick, a lead each; those without predictions have no `used`. `losses`: of
/// an entrant that learns an advance.
std::vector<ComparisonRow> rows_of(const Entrant& entrant, const Field& field, const SensedStick& stick,
                                   const AdvanceLosses* losses, const ComparisonOptions& options) {
    const Recording& recording = field.recordings[stick.recording];
    std::vector<ComparisonRow> rows(stick.leads_s.size());
    for (const std::vector<std::size_t>& pass : passes_of(entrant, stick.recording)) {
        const auto predictor = make_entrant(entrant, stick, pass.front(), stick.leads_s);
        const std::vector<LeadScore> scores = score_predictor(stick, *predictor);
        for (const std::size_t lead : pass) {
            ComparisonRow& row = rows[lead];
            row.trace = recording.trace.file;
            row.person = recording.person;
            row.stick = stick.name;
            row.predictor = entrant.name;
            row.used = entrant.used[stick.recording][lead];
            row.lead_s = stick.leads_s[lead];
            row.rate_hz = stick.rate_hz;
            row.noise_mm = 1e3 * options.sensor.noise_m;
            row.external = entrant.external;
            row.error = scores[lead].error;
            row.calibration = scores[lead].calibration();
            if (losses) row.advance_s = losses->best_s(recording, lead);
            if (options.surface.kind != StrikeSurface::Kind::none)
                row.hits = hits_of(entrant, field, stick, lead, options, row.advance_s.value_or(0));
        }
    }
    return rows;
}

constexpr double kLongestS = 0.150, kStepS = 0.010;
constexpr double kWindowS = 3, kZoomS = 0.6;

/// Of the leads asked for, the one nearest to `lead_s`.
std::size_t nearest(const std::vector<double>& asked_s, double lead_s) {
    const auto distance = [&](double asked) { return std::abs(asked - lead_s); };
    return static_cast<std::size_t>(std::ranges::min_element(asked_s, {}, distance) - asked_s.begin());
}

LeadCurve curve_of(const Entrant& entrant, std::span<const SensedStick> sticks,
                   const std::vector<double>& asked_s) {
    const std::vector<double>& leads_s = sticks.front().leads_s;
    std::vector<SquareSum> sums(leads_s.size());
    for (const SensedStick& stick : sticks) {
        for (const std::vector<std::size_t>& pass : passes_of(entrant, stick.recording)) {
            const auto predictor = make_entrant(entrant, stick, pass.front(), leads_s);
            const std::vector<SquareSum> scored = score_positions(stick, *predictor);
            for (std::size_t lead = 0; lead < leads_s.size(); ++lead)
                if (std::ranges::count(pass, nearest(asked_s, leads_s[lead])) > 0)
                    sums[lead].add(scored[lead]);
        }
    }
    LeadCurve curve{entrant.name, {}};
    for (std::size_t lead = 0; lead < leads_s.size(); ++lead)
        if (sums[lead].count > 0) curve.rms_mm.emplace_back(leads_s[lead], sums[lead].rms());
    return curve;
}

/// Start of the `length_s` in [from_s, to_s] in which the recorded point rises and falls most.
double liveliest(const std::vector<tracking::PoseSample>& samples, double from_s, double to_s,
                 double length_s) {
    double best = -1, start_s = from_s, sum = 0;
    std::size_t first = 0;
    while (first + 1 < samples.size() && samples[first].t_s < from_s) ++first;
    const auto way = [&](std::size_t i) {
        return std::abs(samples[i].position.y() - samples[i - 1].position.y());
    };
    for (std::size_t i = first + 1; i < samples.size() && samples[i].t_s <= to_s; ++i) {
        sum += way(i);
        while (samples[i].t_s - samples[first].t_s > length_s) sum -= way(++first);
        if (sum > best) best = sum, start_s = samples[first].t_s;
    }
    return start_s;
}

FigurePath path_of(const Entrant& entrant, const SensedStick& stick, std::size_t lead,
                   const StickFigure& figure) {
    FigurePath path{entrant.name, entrant.used[stick.recording][lead], stick.leads_s[lead], {}};
    const auto predictor = make_entrant(entrant, stick, lead, stick.leads_s);
    replay(*predictor, stick.samples, [&](const ReplayedSample& now) {
        const double t_s = predictor->time_s() + now.behind_s + path.lead_s;
        if (t_s >= figure.from_s && t_s <= figure.to_s)
            path.height_m.emplace_back(t_s, predictor->predict(path.lead_s + now.behind_s).position.y());
    });
    return path;
}

/// Names of the predictors whose paths are drawn.
std::vector<std::string> drawn_predictors(const Comparison& comparison) {
    const std::vector<double>& leads_s = comparison.options.leads_s;
    const double middle_s = leads_s[leads_s.size() / 2];
    const ComparisonSummary* best = nullptr;
    bool thesis = false, naive = false;
    for (const ComparisonSummary& summary : comparison.summaries) {
        thesis = thesis || summary.predictor == "thesis";
        naive = naive || summary.predictor == "naive";
        if (summary.lead_s == middle_s && !summary.baseline && !summary.external &&
            (best == nullptr || summary.error.position.rms() < best->error.position.rms()))
            best = &summary;
    }
    std::vector<std::string> names;
    if (thesis) names.emplace_back("thesis");
    if (best != nullptr && best->predictor != "thesis") names.push_back(best->predictor);
    if (naive) names.emplace_back("naive");
    return names;
}

}  // namespace

std::vector<ComparisonRow> score_entrants(const Field& field, const Field& tuning,
                                          const std::vector<Entrant>& entrants,
                                          const ComparisonOptions& options) {
    const Field& others = tuning.recordings.empty() ? field : tuning;
    const auto learner =
        std::ranges::find_if(entrants, [](const Entrant& e) { return !e.strikes_by.empty(); });
    std::optional<AdvanceLosses> losses;
    if (learner != entrants.end() && options.tuning && options.surface.kind != StrikeSurface::Kind::none &&
        (!tuning.recordings.empty() || field.recordings.size() > 1))
        losses.emplace(others, *learner, options);
    std::vector<std::vector<ComparisonRow>> parts(field.sticks.size() * entrants.size());
    const auto score = [&](std::size_t i) {
        const auto entrant = entrants.begin() + static_cast<std::ptrdiff_t>(i % entrants.size());
        parts[i] = rows_of(*entrant, field, field.sticks[i / entrants.size()],
                           entrant == learner && losses ? &*losses : nullptr, options);
    };
    parallel_for(parts.size(), options.threads, score, options.progress);
    std::vector<ComparisonRow> rows;
    for (std::size_t i = 0; i < parts.size(); ++i) {
        std::erase_if(parts[i], [](const ComparisonRow& row) { return row.used.empty(); });
        for (ComparisonRow& row : parts[i]) {
            if (!options.cost || row.external) continue;
            // A specification that runs at several leads is measured once.
            const auto same = std::ranges::find(parts[i], row.used, &ComparisonRow::used);
            row.ns_per_sample = &*same != &row
                                    ? same->ns_per_sample
                                    : nanoseconds_per_sample(row.used, field.sticks[i / entrants.size()]);
        }
        std::ranges::move(parts[i], std::back_inserter(rows));
    }
    return rows;
}

std::vector<LeadCurve> lead_curves(std::span<const Recording> recordings,
                                   const std::vector<Entrant>& entrants, const ComparisonOptions& options) {
    std::vector<double> leads_s;
    for (int k = 0; k * kStepS < kLongestS + kStepS / 2; ++k) leads_s.push_back(k * kStepS);
    const std::vector<SensedStick> sticks = sense_all(recordings, options.sensor, leads_s);
    std::vector<LeadCurve> curves(entrants.size());
    parallel_for(entrants.size(), options.threads, [&](std::size_t i) {
        if (!entrants[i].external) curves[i] = curve_of(entrants[i], sticks, options.leads_s);
    });
    std::erase_if(curves, [](const LeadCurve& curve) { return curve.predictor.empty(); });
    return curves;
}

StickFigure stick_figure(const Field& field, const std::vector<Entrant>& entrants,
                         const Comparison& comparison) {
    const SensedStick& stick = field.sticks.front();
    const tracking::Trace& trace = field.recordings.front().trace;
    const std::vector<tracking::PoseSample>& recorded = trace.sticks.front().samples;
    StickFigure figure;
    figure.trace = trace.file;
    figure.stick = stick.name;
    figure.from_s = liveliest(recorded, recorded.front().t_s + kSettlingS, recorded.back().t_s, kWindowS);
    figure.to_s = figure.from_s + kWindowS;
    figure.zoom_from_s = liveliest(recorded, figure.from_s, figure.to_s, kZoomS);
    figure.zoom_to_s = figure.zoom_from_s + kZoomS;
    for (const tracking::PoseSample& sample : recorded)
        if (sample.t_s >= figure.from_s && sample.t_s <= figure.to_s)
            figure.recorded_m.emplace_back(sample.t_s, sample.position.y());
    for (const std::string& name : drawn_predictors(comparison)) {
        const Entrant& entrant = *std::ranges::find(entrants, name, &Entrant::name);
        for (std::size_t lead = 0; lead < stick.leads_s.size(); ++lead)
            figure.paths.push_back(path_of(entrant, stick, lead, figure));
    }
    return figure;
}

}  // namespace app
