#pragma once
#include <Eigen/Geometry>

namespace sim {

/// Superquadric centred at the origin of the body frame:
///   F(r) = ((|x/a|^(2/e2) + |z/c|^(2/e2))^(e2/e1)) + |y/b|^(2/e1),  surface F = 1, inside F < 1 (thesis 2.6,
///   generalised)
/// with semi-axes (a, b, c) [m]. The y axis is the body's axis of revolution for a = c, e2 = 1: a drum is e1
/// = 0.1 (flat heads, straight shell), e2 = 1; a bell e1 = 1, e2 = 1. Exponents are clamped to [0.1, 1.9].
struct Superquadric {
    Eigen::Vector3d semi_axes = Eigen::Vector3d::Ones();
    double e1 = 1, e2 = 1;
};

/// Value and gradient of the signed distance to the surface [m], negative inside. See signed_distance.
struct SurfacePoint {
    double distance;         ///< [m]
    Eigen::Vector3d normal;  ///< outward unit normal at the nearest surface point
};

}  // namespace sim
