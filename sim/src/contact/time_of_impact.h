#pragma once
#include "body/body_path.h"
#include "contact/convex_distance.h"

namespace sim {

/// Where two moving bodies first meet within a step.
struct Impact {
    bool meets = false;
    bool at_once = false;  ///< nearer than the tolerance when the path began
    double time = 0;       ///< since the step's start [s]
    int distances = 0;     ///< computed
};

/// The first time at which two bodies on their paths are within `tolerance` [m], by conservative advancement
/// (Mirtich 1996): with n the normal of their distance at t, the gap along n closes at most at
///   c = -n . (v_a - v_b) + |n x w_a| s_a + |n x w_b| s_b,    s = ConvexBody::turn_reach,
/// leg by leg, so up to where the gap is used up nothing meets. While they are far apart the balls that hold
/// them do instead (s = 0). A miss is known as soon as a plane parts the bodies to the end. Paths that pass each
/// other without turning take 2 to 8 distances. After kMostDistances the bodies count as met where they are (a
/// gap that is still closing). Bodies keep the shape they are posed in. The speed of a turn is taken as steady
/// over a leg.
[[nodiscard]] Impact time_of_impact(const ConvexBody& a, const BodyPath& path_a, const ConvexBody& b,
                                    const BodyPath& path_b, double tolerance) noexcept;

}  // namespace sim
