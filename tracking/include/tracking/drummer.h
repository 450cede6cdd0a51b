#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "tracking/trace.h"

namespace tracking {

/// What a stroke of the synthetic drummer does at its lowest point.
enum class StrokeKind {
    hit,    ///< the tip enters the target's surface at `speed_mps` and rebounds
    feint,  ///< the same downstroke stops or turns back `turn_height_m` above the surface
};

/// One stroke of a score. World frame, SI, +y up.
struct Stroke {
    double t_s = 0;  ///< time at which the tip is lowest
    std::string stick;
    Eigen::Vector3d target = Eigen::Vector3d::Zero();  ///< point of the struck surface, tip's radius included
    Eigen::Vector3d normal = Eigen::Vector3d::UnitY();  ///< outward unit normal there
    double speed_mps = 4;  ///< tip's speed towards the surface at contact (of the unfeinted stroke)
    StrokeKind kind = StrokeKind::hit;
    double turn_height_m = 0.03;  ///< feints only
};

/// The drummer's body and sensor: a stick that turns about a wrist which travels from target to target.
///
/// A stroke rises to `rise_m`, comes down with constant acceleration to `speed_mps` at the surface, goes in
/// and out along half-sines (a linear spring; the surface is met (pi/2) depth_m / speed_mps before t_s), and
/// rebounds. A feint leaves the same downstroke to brake at up to 500 m/s^2. The tip's path is C1 and stays
/// below 2000 m/s^2 except in contact. Strokes that follow each other closely rise less (the result's source
/// counts them), slow ones go less deep. Impossible, hence errors: two strokes of a stick less than
/// 30 ms apart, travel or speeds that need more than those accelerations.
///
/// A contact lasts 4 to 13 ms: at 120 Hz samples may straddle it (half the hits of 4 m/s show less than 3 mm
/// of depth_m = 6 mm); 240 Hz with depth_m = 12 mm shows every hit up to 8 m/s.
struct DrummerParameters {
    double rate_hz = 120;
    double stick_length_m = 0.40;  ///< hand (tracked point) to tip, along body -z
    double rise_m = 0.18;          ///< how far the tip rises before a full stroke
    double restitution = 0.6;      ///< share of the speed that a hit gives back
    double depth_m = 0.006;        ///< how deep a hit goes into the resting surface
    double noise_m = 0.00025;      ///< standard deviation of position noise, each axis
    double noise_rad = 0.001;      ///< of orientation noise, each axis
    std::uint64_t seed = 1;
};

/// Synthesises a trace of the strokes (any order; each stick's sorted by time). Samples are the tracked
/// hand's poses with tip at (0, 0, -stick_length). The result's source says that it is synthetic. Throws
/// std::invalid_argument for an impossible score or parameters out of range.
[[nodiscard]] Trace synthesise(const std::vector<Stroke>& score, double duration_s,
                               const DrummerParameters& parameters);

}  // namespace tracking
