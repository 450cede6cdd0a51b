#pragma once
#include <Eigen/Core>

#include "kit/kit.h"

namespace app {

/// A point of an instrument's surface at rest, grown by the tip's radius, and the outward unit normal there.
/// World frame [m].
struct StrikeTarget {
    Eigen::Vector3d point, normal;
};

/// Where a player strikes: from above, upright bells from the player's side (body +z, a little above).
/// `across` and `along` shift the place from the middle of that side, as shares (below 1) of the half extents
/// to the body's right (x) and away from its front (-z, for bells up).
[[nodiscard]] StrikeTarget strike_target(const Instrument& instrument, double tip_radius_m, double across,
                                         double along);

}  // namespace app
