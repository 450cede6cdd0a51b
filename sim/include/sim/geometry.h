#pragma once
#include <Eigen/Geometry>
#include <vector>

namespace sim {

/// Superquadric centred at the origin of the body frame (thesis 2.6, generalised); semi-axes (a, b, c) [m]:
///   F(r) = (|x/a|^(2/e2) + |z/c|^(2/e2))^(e2/e1) + |y/b|^(2/e1),   surface F = 1, inside F < 1
///
/// The y axis is the body's axis of revolution for a = c, e2 = 1: a drum is e1 = 0.1 (flat heads, straight
/// shell), e2 = 1; a bell e1 = 1, e2 = 1. Exponents are clamped to [0.1, 1.9].
struct Superquadric {
    Eigen::Vector3d semi_axes = Eigen::Vector3d::Ones();
    double e1 = 1, e2 = 1;
};

/// A smooth spike (or dent) on a surface: the surface is displaced along its normal by
///   height exp(-(angle / width)^2),   angle between r / semi_axes and `direction` / semi_axes.
struct Bump {
    Eigen::Vector3d direction = Eigen::Vector3d::UnitY();  ///< from the centre towards the spike, body frame
    double height_m = 0;                                   ///< negative: a dent
    double width_rad = 0.2;
};

/// A superquadric displaced along its normal (the spiked bodies of figure 2-10). Mass and inertia are those
/// of the superquadric alone.
struct GeneralizedSuperquadric {
    Superquadric base;
    std::vector<Bump> bumps;
};

/// Value and gradient of the signed distance to the surface [m], negative inside. See signed_distance.
struct SurfacePoint {
    double distance;         ///< [m]
    Eigen::Vector3d normal;  ///< outward unit normal at the nearest surface point
};

}  // namespace sim
