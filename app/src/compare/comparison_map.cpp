#include "compare/comparison_map.h"

#include <algorithm>
#include <iterator>
#include <tuple>

#include "compare/entrants.h"
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
                       paired_difference(pairs, sensor.seed),
                       {}};
        cells.push_back(std::move(cell));
    }
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

}  // namespace app
