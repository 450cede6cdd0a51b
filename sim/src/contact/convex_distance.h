#pragma once
#include "contact/convex_body.h"

namespace sim {

/// A convex body in the world.
struct PlacedConvex {
    const ConvexBody* body;
    Eigen::Vector3d position;  ///< [m]
    Eigen::Matrix3d rotation;  ///< body to world
};

/// Where two bodies are nearest.
struct ConvexDistance {
    bool apart;  ///< false: the cores overlap, and nothing else here is right
    double gap;  ///< at least this far along the normal, exact to the tolerance; negative: overlap [m]
    Eigen::Vector3d normal;          ///< unit, world axes, from b towards a
    Eigen::Vector3d arm_a, arm_b;    ///< nearest surface points, from the centres, world axes [m]
    Eigen::Vector3d rest_a, rest_b;  ///< the same in the rest shapes [m]
};

/// Distance of two convex bodies at any range by the algorithm of Gilbert, Johnson and Keerthi (1988): the
/// point of A - B nearest to the origin, out of simplices of support points. v the nearest point so far and w
/// the furthest along -v, the plane through w with normal v parts the bodies: v . w / |v| is a lower bound of
/// the distance, and |v| an upper one. Ends when they agree to `tolerance` [m], or to `share` of the gap, or
/// after 48 supports a body (then `gap` is still a lower bound). Balls take one step, ellipsoids 4 to 10,
/// boxes 5 to 20. Pure, deterministic, no allocation.
[[nodiscard]] ConvexDistance distance_between(const PlacedConvex& a, const PlacedConvex& b, double tolerance,
                                              double share = 0) noexcept;

}  // namespace sim
