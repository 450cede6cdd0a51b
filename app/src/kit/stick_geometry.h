#pragma once
#include <tracking/trace.h>

#include "kit/kit.h"
#include "kit/tip_track.h"

namespace app {

/// Where the tip and the shaft lie in the tracked body's frame: an option overrides the kit, the kit the
/// trace.
struct StickGeometry {
    Eigen::Vector3d tip = Eigen::Vector3d::Zero();      ///< centre of the tip [m]
    Eigen::Vector3d shaft = -Eigen::Vector3d::UnitZ();  ///< unit, hand to tip
    double radius_m = 0.006;
    double length_m = 0.40;
};

[[nodiscard]] StickGeometry stick_geometry(const tracking::Trace& trace, const StickDefinition& stick,
                                           const std::optional<Eigen::Vector3d>& tip_option,
                                           const std::optional<Eigen::Vector3d>& shaft_option);

/// The measured path of a stick's tip.
[[nodiscard]] TipTrack tip_track(const tracking::StickTrace& stick, const StickGeometry& geometry);

/// The measured paths of the sticks' tips, a track a stick.
[[nodiscard]] std::vector<TipTrack> tip_tracks(const tracking::Trace& trace, const StickGeometry& geometry);

}  // namespace app
