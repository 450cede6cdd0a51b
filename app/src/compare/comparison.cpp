#include "compare/comparison.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <iterator>
#include <map>
#include <memory>
#include <tuple>

#include "compare/comparison_figures.h"
#include "compare/entrants.h"
#include "compare/experiment.h"
#include "compare/sample_errors.h"
#include "compare/transfer.h"
#include "files/bad_input.h"
#include "process/parallel.h"
#include "sticks/predictors.h"
#include "sticks/stick.h"

namespace app {
namespace {

constexpr double kMm = 1e-3, kMs = 1e-3;
constexpr std::size_t kFewestRecordings = 5;  // that make an interval

std::vector<tracking::SensorModel> sensors_of(const MapAxes& axes, const ComparisonOptions& options) {
    std::vector<tracking::SensorModel> sensors;
    for (const double rate_hz : axes.rates_hz)
        for (const double noise_mm : axes.noises_mm)
            for (const double jitter_ms : axes.jitters_ms)
                for (const double drop_out : axes.drop_outs) {
                    tracking::SensorModel sensor = options.sensor;
                    sensor.rate_hz = rate_hz;
                    sensor.noise_m = kMm * noise_mm;
                    sensor.jitter_s = kMs * jitter_ms;
                    sensor.drop_out = drop_out;
                    sensors.push_back(sensor);
                }
    return sensors;
}

/// One thing that runs: a family tuned on other recordings, or a specification as named.
struct Runner {
    std::string name;
    bool baseline = false;
    std::vector<SquareSum> by_recording = {};
    SquareSum pooled = {};

    void add(const SquareSum& recording) { by_recording.push_back(recording), pooled.add(recording); }
};

/// What a map compares: families that are tuned, and the other specifications as named.
struct MapField {
    std::vector<std::string> families, as_named;
};

MapField field_of(const ComparisonOptions& options, bool tunable) {
    MapField field;
    field.as_named = specifications_of(options);
    std::erase_if(field.as_named, is_external);
    if (!tunable) return field;
    field.families = tunable_families(field.as_named);
    std::erase_if(field.as_named, [](const std::string& specification) {
        return !tuning_grid(family_of(specification)).empty();
    });
    return field;
}

std::vector<Runner> runners_of(const TuningTable& table, const MapField& field, std::size_t lead) {
    std::vector<Runner> runners;
    for (std::size_t i = 0; i < field.as_named.size(); ++i) {  // first in the table
        Runner& runner = runners.emplace_back(Runner{field.as_named[i], is_baseline(field.as_named[i])});
        for (std::size_t r = 0; r < table.recordings(); ++r) runner.add(table.sum(i, r, lead));
    }
    for (const std::string& family : field.families) {
        Runner& runner = runners.emplace_back(Runner{family + "*", is_baseline(family)});
        for (std::size_t r = 0; r < table.recordings(); ++r) {
            std::vector<bool> allowed(table.recordings(), true);
            allowed[r] = false;
            const std::optional<std::size_t> best = table.best(family, lead, allowed);
            runner.add(best ? table.sum(*best, r, lead) : SquareSum{});
        }
    }
    return runners;
}

void add_cells(std::vector<MapCell>& cells, const std::vector<Runner>& runners,
               const tracking::SensorModel& sensor, double lead_s) {
    const auto estimators = static_cast<std::size_t>(std::ranges::count(runners, false, &Runner::baseline));
    const Runner* baseline = nullptr;
    for (const Runner& runner : runners)
        if (runner.baseline && (baseline == nullptr || runner.pooled.rms() < baseline->pooled.rms()))
            baseline = &runner;
    for (const Runner& runner : runners) {
        if (runner.baseline || baseline == nullptr) continue;
        MapCell cell{sensor.rate_hz, sensor.noise_m / kMm, sensor.jitter_s / kMs, sensor.drop_out, {}};
        std::vector<PairedSums> pairs;
        for (std::size_t r = 0; r < runner.by_recording.size(); ++r)
            if (runner.by_recording[r].count > 0)
                pairs.push_back({runner.by_recording[r], baseline->by_recording[r]});
        cell.result = {runner.name,
                       baseline->name,
                       lead_s,
                       runner.pooled.rms(),
                       baseline->pooled.rms(),
                       paired_difference(pairs, sensor.seed, kFewestRecordings, estimators),
                       {}};
        cells.push_back(std::move(cell));
    }
}

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
    /// Of `auto`, which runs the same on every recording.
    AdvanceLosses(const Field& field, const Entrant& entrant, const ComparisonOptions& options)
        : field_(field), leads_(options.leads_s.size()), losses_(field.sticks.size() * leads_) {
        parallel_for(losses_.size(), options.threads, [&](std::size_t i) {
            for (std::size_t k = 0; k < kAdvances; ++k)
                losses_[i][k] = strikes_of(entrant, field, field.sticks[i / leads_], i % leads_, options,
                                           {options.leads_s[i % leads_], advance_s(k)})
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
double nanoseconds_per_sample(const PredictorMaker& maker, const SensedStick& stick) {
    const std::span timed = std::span(stick.samples).first(std::min(stick.samples.size(), kMostTimedSamples));
    std::vector<double> costs;
    for (std::size_t pass = 0; pass < kCostPasses; ++pass) {
        const auto predictor = maker.make(stick.leads_s, {stick.name, stick.shaft});
        const auto start = std::chrono::steady_clock::now();
        for (const tracking::PoseSample& sample : timed) {
            const double behind_s = tracking::feed(*predictor, sample);
            for (const double lead_s : stick.leads_s)
                keep(predictor->predict(lead_s + behind_s).position.x());
        }
        const std::chrono::duration<double, std::nano> spent = std::chrono::steady_clock::now() - start;
        costs.push_back(spent.count() / static_cast<double>(timed.size()));
    }
    return median(std::move(costs));
}

/// The rows of one entrant on one stick, a lead each; those without predictions have no `used`. `losses`: of
/// an entrant that learns an advance.
std::vector<ComparisonRow> rows_of(const Entrant& entrant, const Field& field, const SensedStick& stick,
                                   const AdvanceLosses* losses, const ComparisonOptions& options,
                                   SampleRows* samples) {
    const Recording& recording = field.recordings[stick.recording];
    std::vector<ComparisonRow> rows(stick.leads_s.size());
    for (const std::vector<std::size_t>& pass : passes_of(entrant, stick.recording)) {
        const auto predictor = make_entrant(entrant, stick, pass.front(), stick.leads_s);
        SeePrediction see;
        if (samples != nullptr)
            see = [&](std::size_t sample, std::size_t lead, const auto& predicted, const auto& covariance) {
                if (std::ranges::count(pass, lead) > 0) samples->add(sample, lead, predicted, covariance);
            };
        const std::vector<LeadScore> scores = score_predictor(stick, *predictor, see);
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
                row.hits =
                    strikes_of(entrant, field, stick, lead, options, {row.lead_s, row.advance_s.value_or(0)});
        }
    }
    return rows;
}

/// Runs every entrant over every stick of the field at every lead: errors and calibration; strikes, if there
/// is a surface, those of an entrant that learns an advance with the one that it learned (on `tuning`, of
/// --tune, or, if that is empty, on all others of the field; never on the one that is scored); cost, if asked
/// for. By stick, entrant, lead, but where an entrant does not take part. The rows do not depend on
/// `options.threads`.
std::vector<ComparisonRow> score_entrants(const Field& field, const Field& tuning,
                                          const std::vector<Entrant>& entrants,
                                          const ComparisonOptions& options) {
    const Field& others = tuning.recordings.empty() ? field : tuning;
    std::map<std::string, AdvanceLosses> losses;
    if (options.tuning && options.surface.kind != StrikeSurface::Kind::none &&
        (!tuning.recordings.empty() || field.recordings.size() > 1))
        for (const Entrant& entrant : entrants)
            if (!entrant.strikes_by.empty())
                losses.emplace(entrant.name, AdvanceLosses(others, entrant, options));
    std::vector<std::vector<ComparisonRow>> parts(field.sticks.size() * entrants.size());
    std::optional<OrderedFile> file;
    if (options.samples) file.emplace(*options.samples, SampleRows::header());
    const auto score = [&](std::size_t i) {
        const auto entrant = entrants.begin() + static_cast<std::ptrdiff_t>(i % entrants.size());
        const SensedStick& stick = field.sticks[i / entrants.size()];
        const Recording& recording = field.recordings[stick.recording];
        std::optional<SampleRows> samples;
        if (file) samples.emplace(stick, recording.trace.file, recording.person, entrant->name);
        const auto learned = losses.find(entrant->name);
        parts[i] = rows_of(*entrant, field, stick, learned != losses.end() ? &learned->second : nullptr,
                           options, samples ? &*samples : nullptr);
        if (file) file->add(i, samples->take());
    };
    parallel_for(parts.size(), options.threads, score, options.progress);
    if (file) file->finish();
    std::vector<ComparisonRow> rows;
    for (std::size_t i = 0; i < parts.size(); ++i) {
        std::erase_if(parts[i], [](const ComparisonRow& row) { return row.used.empty(); });
        for (ComparisonRow& row : parts[i]) {
            if (!options.cost || row.external) continue;
            // A specification that runs at several leads is measured once.
            const auto same = std::ranges::find(parts[i], row.used, &ComparisonRow::used);
            row.ns_per_sample =
                &*same != &row
                    ? same->ns_per_sample
                    : nanoseconds_per_sample(PredictorMaker(row.used, entrants[i % entrants.size()].model),
                                             field.sticks[i / entrants.size()]);
        }
        std::ranges::move(parts[i], std::back_inserter(rows));
    }
    return rows;
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
            result.by_recording = paired_difference(paired_sums(own, base, &ComparisonRow::trace), seed,
                                                    kFewestRecordings, comparison.estimators);
            result.rms_mm = result.baseline_rms_mm + result.by_recording.difference_mm;
            if (const auto persons = paired_sums(own, base, &ComparisonRow::person); persons.size() >= 2)
                result.by_person = paired_difference(
                    persons, seed, result.by_recording.has_interval() ? 2 : persons.size() + 1,
                    comparison.estimators);
            results.push_back(std::move(result));
        }
    return results;
}

}  // namespace

std::vector<MapCell> map_sensors(std::span<const Recording> recordings, const ComparisonOptions& options,
                                 const MapAxes& axes) {
    const MapField field = field_of(options, options.tuning && recordings.size() >= 2);
    const std::vector<tracking::SensorModel> sensors = sensors_of(axes, options);
    std::vector<std::vector<MapCell>> parts(sensors.size());
    const auto work = [&](std::size_t i) {
        const std::vector<SensedStick> sticks = sense_all(recordings, sensors[i], options.leads_s);
        std::vector<std::string> as_named;
        std::ranges::transform(field.as_named, std::back_inserter(as_named), picture_specification);
        const TuningTable table(as_named, field.families, sensors[i].noise_m / kMm, sticks, 1);
        for (std::size_t lead = 0; lead < options.leads_s.size(); ++lead)
            add_cells(parts[i], runners_of(table, field, lead), sensors[i], options.leads_s[lead]);
    };
    parallel_for(sensors.size(), options.threads, work, options.progress);
    std::vector<MapCell> map;
    for (std::vector<MapCell>& part : parts) std::ranges::move(part, std::back_inserter(map));
    return map;
}

std::vector<MapCell> best_cells(const std::vector<MapCell>& map) {
    const auto place_of = [](const MapCell& cell) {
        return std::tuple(cell.rate_hz, cell.noise_mm, cell.jitter_ms, cell.drop_out, cell.result.lead_s);
    };
    std::vector<MapCell> best;
    for (const MapCell& cell : map) {
        if (best.empty() || place_of(best.back()) != place_of(cell))
            best.push_back(cell);
        else if (cell.result.rms_mm < best.back().result.rms_mm)
            best.back() = cell;
    }
    return best;
}

Comparison compare(const ComparisonOptions& asked) {
    const ComparisonOptions options = asked.transfer.empty() ? asked : parted_for_transfer(asked);
    Comparison comparison;
    comparison.options = options;
    comparison.inputs = inputs_of(options);
    const Field field = read_scored(options);
    for (const Recording& recording : field.recordings)
        if (std::ranges::find(comparison.persons, recording.person) == comparison.persons.end())
            comparison.persons.push_back(recording.person);
    const Field tuning =
        options.tuning || !options.transfer.empty()
            ? read_field(options.tune_traces, options.persons, options.sensor, options.leads_s)
            : Field();
    EntrantList list = enter(options, field, tuning);
    if (!options.transfer.empty())
        std::ranges::move(trained_entrants(options, field, tuning), std::back_inserter(list.entrants));
    comparison.tuned_on = list.tuned_on;
    comparison.estimators =
        static_cast<std::size_t>(std::ranges::count(list.entrants, false, &Entrant::baseline));
    comparison.rows = score_entrants(field, tuning, list.entrants, options);
    for (const Entrant& entrant : list.entrants) {
        comparison.predictors.emplace_back(entrant.name, entrant.description);
        for (const double lead_s : options.leads_s)
            if (ComparisonSummary summary = summary_of(entrant, lead_s, comparison.rows);
                summary.error.position.count > 0)
                comparison.summaries.push_back(std::move(summary));
    }
    comparison.paired = pair_with_baselines(comparison, list.entrants);
    comparison.curves = lead_curves(field, list.entrants, options);
    comparison.figure = stick_figure(field, list.entrants, comparison);
    if (options.map) comparison.map = map_sensors(field.recordings, options);
    return comparison;
}

}  // namespace app
