#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "tracking/trace.h"

namespace tracking {

/// A sensor that sees a recorded path: its rate, noise and faults, so that one recording stands for many
/// sensors. The faults act in the order of the members; each draws from a random stream of its own, derived
/// from `seed`, so that changing one fault leaves the others' draws alone.
struct SensorModel {
    double rate_hz = 0;       ///< samples at t0 + k / rate_hz; 0: at the recording's own times
    double jitter_s = 0;      ///< standard deviation of a sample's time about its nominal one, normal, cut so
                              ///< that neighbours keep their order (within 0.45 periods)
    bool true_stamps = true;  ///< samples carry the time at which they were taken; false: the nominal one
    double drop_out = 0;      ///< share of samples lost, in [0, 0.9], in bursts (two-state Markov chain) ...
    double burst = 3;         ///< ... of this mean length [samples], at least 1 and drop_out / (1 - drop_out)
    double noise_m = 0;       ///< standard deviation of white position noise on each axis
    double noise_rad = 0;     ///< of a small rotation's vector, each axis, world frame
    double quantum_m = 0;     ///< positions are rounded to multiples of this; 0: not rounded
    double quantum_rad = 0;   ///< rotation vectors likewise
    double outlier = 0;       ///< share of samples replaced by a position up to `outlier_m` away
    double outlier_m = 0.5;   ///< radius of the ball that outliers fall into, about the true position
    double latency_s = 0;     ///< every stamp is later than the pose it carries by this
    double duplicate = 0;     ///< share of samples that arrive twice
    double late = 0;          ///< share of samples that arrive after their successor, at most 0.5
    std::uint64_t seed = 1;

    /// Throws std::invalid_argument (found, expected) for values out of range.
    void check() const;
};

/// The path between samples: positions linear, orientations by slerp the shorter way. Nothing outside the
/// recording or inside a gap of more than kGapS. O(log n).
[[nodiscard]] std::optional<PoseSample> pose_at(const StickTrace& stick, double t_s);

/// What the sensor reports of a stick, in the order of arrival: stamps increase strictly only without
/// `duplicate` and `late`. A pure function of its input, the same on every machine (no standard
/// distributions). `stick_index` gives each stick its own noise.
[[nodiscard]] std::vector<PoseSample> sense(const StickTrace& stick, const SensorModel& sensor,
                                            std::size_t stick_index = 0);
/// The same of a trace's stick `index`; what cannot be sensed is a TraceError that names the trace's file.
[[nodiscard]] std::vector<PoseSample> sense(const Trace& trace, std::size_t index, const SensorModel& sensor);

}  // namespace tracking
