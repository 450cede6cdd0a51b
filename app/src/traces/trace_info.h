#pragma once
#include <tracking/trace.h>

#include <Eigen/Core>
#include <string>
#include <vector>

#include "statistics/statistics.h"

namespace app {

/// What one stick of a trace is like. Times in s on the trace's clock, lengths in m; speeds are the tip's,
/// between samples.
struct StickInfo {
    std::string name;
    std::size_t samples = 0;
    double t0_s = 0, t_end_s = 0;
    double rate_hz = 0;                                  ///< 1 / median dt
    double dt_min_s = 0, dt_median_s = 0, dt_max_s = 0;  ///< between samples
    int gaps = 0;                                        ///< dt above tracking::kGapS
    Eigen::Vector3d low = Eigen::Vector3d::Zero(),
                    high = Eigen::Vector3d::Zero();  ///< extents of the tip's path
    double speed_median_mps = 0, speed_p95_mps = 0, speed_max_mps = 0;
    bool orientation = false;  ///< every sample has one
    int flips = 0;             ///< turns by more than 90 degrees between samples: faults of a tracker, mostly
    double first_flip_s = 0;
    int strokes = 0;  ///< height minima of the tip, prominence 25 mm
};

[[nodiscard]] std::vector<StickInfo> trace_info(const tracking::Trace& trace);
[[nodiscard]] std::string format_info(const tracking::Trace& trace, const std::vector<StickInfo>& sticks);
[[nodiscard]] std::string format_info_json(const tracking::Trace& trace,
                                           const std::vector<StickInfo>& sticks);

}  // namespace app
