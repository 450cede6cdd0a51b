#pragma once
#include <Eigen/Core>

#include "shape/superquadric.h"

namespace sim {

/// D of (2.12) with its inverse.
struct Deformation {
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
    Eigen::Matrix3d inverse = Eigen::Matrix3d::Identity();
};

struct ClosestPoint {
    double distance;             ///< signed, to the deformed surface, negative inside [m]
    Eigen::Vector3d normal;      ///< outward unit normal there, deformed body's frame
    Eigen::Vector3d point;       ///< on the deformed surface [m]
    Eigen::Vector3d rest_point;  ///< the same material point in the rest shape [m]
};

/// Signed distance of `x` to the surface {D r : N(r) = 1}, in the deformed body's metric. Because the body is
/// convex, the surface grown by a radius is at this distance less the radius.
///
/// Minimises |x - D r|^2 over the surface by Newton steps in the tangent plane with Levenberg damping,
///   (I + lambda T^T D^-T H D^-1 T + mu I) s = T^T (x - y),  y = D r,  lambda = n.(x - y) / |D^-T grad N|,
/// each step carried back to the surface along the ray (r / N(r)) and taken only if the distance falls.
/// Outside, the minimum is unique. Inside there may be one a face: the two nearest of the four feet (along
/// the ray and along each axis) are refined. `start`, a surface point of the rest shape near the answer,
/// replaces that search; the answer is then a local one when x is inside. Pure, no allocation, never NaN for
/// finite x; 3-6 steps of about 0.1 us each.
[[nodiscard]] ClosestPoint closest_point(const Gauge& gauge, const Deformation& deformation,
                                         const Eigen::Vector3d& x,
                                         const Eigen::Vector3d* start = nullptr) noexcept;

}  // namespace sim
