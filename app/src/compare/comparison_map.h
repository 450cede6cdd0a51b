#pragma once
#include <span>
#include <vector>

#include "compare/comparison.h"

namespace app {

/// The sensors of a map: every combination.
struct MapAxes {
    std::vector<double> rates_hz = {30, 60, 120, 240};
    std::vector<double> noises_mm = {0.1, 0.25, 1, 4};
    std::vector<double> jitters_ms = {0, 3};
    std::vector<double> drop_outs = {0, 0.1};
};

/// Position errors of the families of `predictors` (tuned where they have parameters; as named otherwise)
/// over all sensors of `axes`, by sensor, lead, predictor. Samples carry their true times. With fewer than
/// two recordings there is nothing to tune on: the predictors as named. Results do not depend on `threads`.
[[nodiscard]] std::vector<MapCell> map_sensors(std::span<const Recording> recordings,
                                               const ComparisonOptions& options, const MapAxes& axes = {});

/// Of the cells of one sensor and lead, the one of least RMS among estimators.
[[nodiscard]] std::vector<MapCell> best_cells(const std::vector<MapCell>& map);

}  // namespace app
