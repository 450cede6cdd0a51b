#include "compare/comparison_map.h"

#include <algorithm>

#include "compare/entrants.h"
#include "compare/prediction_error.h"
#include "compare/tuning.h"
#include "process/parallel.h"
#include "sticks/predictors.h"

namespace app {
namespace {

constexpr double kMm = 1e-3, kMs = 1e-3;

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

/// Recordings without orientation, which a map does not score.
std::vector<Recording> positions_of(std::span<const Recording> recordings) {
    std::vector<Recording> positions(recordings.begin(), recordings.end());
    for (Recording& recording : positions)
        for (tracking::StickTrace& stick : recording.trace.sticks)
            for (tracking::PoseSample& sample : stick.samples) {
                sample.orientation.setIdentity();
                sample.has_orientation = false;
            }
    return positions;
}

/// One thing that runs: a family tuned on other recordings, or a specification as named.
struct Runner {
    std::string name;
    bool baseline = false;
    std::vector<SquareSum> by_recording;

    [[nodiscard]] double rms_mm() const {
        SquareSum pooled;
        for (const SquareSum& sum : by_recording) pooled.add(sum);
        return pooled.rms_mm();
    }
};

/// What a map compares: families that are tuned, and the other specifications as named.
struct MapField {
    std::vector<std::string> families, as_named;

    [[nodiscard]] std::vector<std::string> specifications(double noise_mm) const {
        std::vector<std::string> all;
        for (const std::string& name : as_named) all.push_back(picture_specification(name));
        for (const std::string& candidate : candidates_of(families, noise_mm)) all.push_back(candidate);
        return all;
    }
};

MapField field_of(const ComparisonOptions& options, bool tunable) {
    MapField field;
    for (const std::string& specification : specifications_of(options)) {
        if (is_external(specification)) continue;
        const std::string family = family_of(specification);
        if (!tunable || tuning_grid(family).empty())
            field.as_named.push_back(specification);
        else if (std::find(field.families.begin(), field.families.end(), family) == field.families.end())
            field.families.push_back(family);
    }
    return field;
}

Runner tuned_runner(const TuningTable& table, const std::string& family, std::size_t lead) {
    Runner runner{family + "*", is_baseline(family), {}};
    for (std::size_t r = 0; r < table.recordings(); ++r) {
        std::vector<bool> allowed(table.recordings(), true);
        allowed[r] = false;
        const std::size_t best = table.best(family, lead, allowed);
        runner.by_recording.push_back(best == TuningTable::npos ? SquareSum{} : table.sum(best, r, lead));
    }
    return runner;
}

std::vector<Runner> runners_of(const TuningTable& table, const MapField& field, std::size_t lead) {
    std::vector<Runner> runners;
    for (std::size_t i = 0; i < field.as_named.size(); ++i) {  // first in the table
        Runner runner{field.as_named[i], is_baseline(field.as_named[i]), {}};
        for (std::size_t r = 0; r < table.recordings(); ++r)
            runner.by_recording.push_back(table.sum(i, r, lead));
        runners.push_back(std::move(runner));
    }
    for (const std::string& family : field.families) runners.push_back(tuned_runner(table, family, lead));
    return runners;
}

std::vector<PairedSums> pairs_of(const Runner& a, const Runner& b) {
    std::vector<PairedSums> pairs;
    for (std::size_t r = 0; r < a.by_recording.size(); ++r)
        if (a.by_recording[r].count > 0)
            pairs.push_back({a.by_recording[r].sum_mm2, b.by_recording[r].sum_mm2, a.by_recording[r].count});
    return pairs;
}

void add_cells(std::vector<MapCell>& cells, const std::vector<Runner>& runners,
               const tracking::SensorModel& sensor, double lead_s) {
    const Runner* baseline = nullptr;
    for (const Runner& runner : runners)
        if (runner.baseline && (baseline == nullptr || runner.rms_mm() < baseline->rms_mm()))
            baseline = &runner;
    if (baseline == nullptr) return;
    for (const Runner& runner : runners) {
        if (runner.baseline) continue;
        MapCell cell{sensor.rate_hz, sensor.noise_m / kMm, sensor.jitter_s / kMs, sensor.drop_out, {}};
        cell.result.predictor = runner.name;
        cell.result.baseline = baseline->name;
        cell.result.lead_s = lead_s;
        cell.result.rms_mm = runner.rms_mm();
        cell.result.baseline_rms_mm = baseline->rms_mm();
        cell.result.by_recording = paired_difference(pairs_of(runner, *baseline), sensor.seed);
        cells.push_back(std::move(cell));
    }
}

}  // namespace

std::vector<MapCell> map_sensors(std::span<const Recording> recordings, const ComparisonOptions& options,
                                 const MapAxes& axes) {
    const std::vector<Recording> positions = positions_of(recordings);
    const MapField field = field_of(options, options.tuning && recordings.size() >= 2);
    const std::vector<tracking::SensorModel> sensors = sensors_of(axes, options);
    std::vector<std::vector<MapCell>> parts(sensors.size());
    const auto work = [&](std::size_t i) {
        const std::vector<SensedStick> sticks = sense_all(positions, sensors[i], options.leads_s);
        const TuningTable table(field.specifications(sensors[i].noise_m / kMm), sticks, positions.size(), 1);
        for (std::size_t lead = 0; lead < options.leads_s.size(); ++lead)
            add_cells(parts[i], runners_of(table, field, lead), sensors[i], options.leads_s[lead]);
    };
    parallel_for(sensors.size(), options.threads, work, options.progress);
    std::vector<MapCell> map;
    for (std::vector<MapCell>& part : parts)
        for (MapCell& cell : part) map.push_back(std::move(cell));
    return map;
}

std::vector<const MapCell*> best_cells(const std::vector<MapCell>& map) {
    const auto same_place = [](const MapCell& a, const MapCell& b) {
        return a.rate_hz == b.rate_hz && a.noise_mm == b.noise_mm && a.jitter_ms == b.jitter_ms &&
               a.drop_out == b.drop_out && a.result.lead_s == b.result.lead_s;
    };
    std::vector<const MapCell*> best;
    for (const MapCell& cell : map) {
        if (best.empty() || !same_place(*best.back(), cell))
            best.push_back(&cell);
        else if (cell.result.rms_mm < best.back()->result.rms_mm)
            best.back() = &cell;
    }
    return best;
}

}  // namespace app
