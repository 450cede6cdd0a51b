#pragma once
#include <sim/world.h>

#include <functional>
#include <string>
#include <vector>

#include "bench/bench_report.h"

namespace app {

/// One way to compute the scene.
struct TradeoffSetting {
    sim::Fidelity fidelity = sim::Fidelity::modal;
    int modes = 12;
    int steps_per_s = 60;
    int elements = 1;  ///< a side
    int triangles = 360;
    double restitution = 0;
};
[[nodiscard]] std::string name_of(const TradeoffSetting& setting);

struct TradeoffPoint {
    TradeoffSetting setting;
    double ms_per_s = 0;  ///< processor time for a simulated second of the scene [ms]
    double error = 0;     ///< rms distance to the converged run, share of the largest extent
    bool pareto = false;  ///< nothing is both faster and nearer
};

/// What is chosen for an accuracy (sim/accuracy.h), from steps of 1/30 s.
struct AutomaticPoint {
    TradeoffPoint point;
    double asked = 0, estimated = 0;  ///< share of the largest extent
    double over_front = 0;  ///< time over that of the fastest point that is as near to the truth; 0: none is
};

struct Tradeoff {
    std::vector<TradeoffPoint> points;
    std::vector<AutomaticPoint> automatic;
    TradeoffSetting converged, finer;
    double converged_error = 0;  ///< of the converged run against the finer one
};

/// Two soft ellipsoids for 0.2 s, before small differences grow: one falls at 1 m/s on the other, which falls
/// on a floor. The error is the rms over 182 surface points of each body and 6 moments.
[[nodiscard]] Tradeoff measure_tradeoff(const std::vector<TradeoffSetting>& settings,
                                        const TradeoffSetting& converged, const TradeoffSetting& finer,
                                        const std::function<void(const std::string&)>& progress);

/// Modes (rigid, linear, 5 ... 75) by step (1/30 ... 1/1920 s) by elements (1 to 3) by triangles (48 to
/// 2000).
[[nodiscard]] std::vector<TradeoffSetting> all_tradeoff_settings();
/// What they are held against, and what shows how far that has converged.
inline constexpr TradeoffSetting kConverged{sim::Fidelity::modal, 75, 3840, 3, 2000};
inline constexpr TradeoffSetting kFiner{sim::Fidelity::modal, 120, 7680, 3, 4000};

/// Marks the points that nothing dominates.
void mark_pareto(std::vector<TradeoffPoint>& points);

/// The front, the automatic point and how converged the reference is; tradeoff.csv, rows of all points:
/// name,modes,step_s,elements,triangles,ms_per_s,error,pareto; tradeoff.svg, error against time.
[[nodiscard]] Figures figures_of(const Tradeoff& tradeoff);

}  // namespace app
