#pragma once
#include <Eigen/Core>

#include "sim/geometry.h"

namespace sim {

/// Value and derivatives of the gauge at one point of the rest shape.
struct GaugeDerivatives {
    Eigen::Vector3d gradient;  ///< [1/m]
    Eigen::Matrix3d hessian;   ///< [1/m^2]
};

/// Value and gradient of the gauge: the plane gradient . y = 1 supports the body at that point.
struct GaugeSlope {
    double value;
    Eigen::Vector3d gradient;  ///< [1/m]
};

/// The superquadric's inside-outside function in the form that the distance needs: the gauge N = F^(e1/2).
///
///   rho = (|x/a|^p2 + |z/c|^p2)^(1/p2),  N = (rho^p1 + |y/b|^p1)^(1/p1),  p1 = 2/e1, p2 = 2/e2,  F = N^p1
///
/// For exponents below 2 both p are above 1, so N is a norm: N(s r) = s N(r), the body {N <= 1} is convex,
/// and r / N(r) lies on the surface. (1 - N) / |grad N| is the first-order distance (1 - F^(e1/2)) / |grad
/// F^(e1/2)|. Near a coordinate plane (|x/a| below 1e-7 of the largest coordinate) the derivatives are those
/// at that height, the gradient made linear across zero: with e > 1 the surface has a kink there, and the
/// derivatives stay finite.
class Gauge {
public:
    explicit Gauge(const Superquadric& shape);  ///< clamps the exponents

    [[nodiscard]] double value(const Eigen::Vector3d& r) const noexcept;  ///< N(r), 1 on the surface
    [[nodiscard]] GaugeDerivatives derivatives(const Eigen::Vector3d& r) const noexcept;  ///< r not zero
    /// Without the curvature, and not made linear near the coordinate planes: at a kink a subgradient. Zero
    /// at the centre.
    [[nodiscard]] GaugeSlope slope(const Eigen::Vector3d& r) const noexcept;
    /// As derivatives, but where p < 2 the curvature is divided by p - 1: then grad N(r) + H s does not
    /// overshoot the kink at a coordinate plane, however near it is (the weights of iteratively reweighted
    /// least squares).
    [[nodiscard]] GaugeDerivatives cautious_derivatives(const Eigen::Vector3d& r) const noexcept;
    [[nodiscard]] bool has_kinks() const noexcept { return e1_ > 1 || e2_ > 1; }
    /// F itself (thesis 2.6, generalised); overflows to infinity far outside when e1 is small.
    [[nodiscard]] double inside_outside(const Eigen::Vector3d& r) const noexcept;
    /// The surface point on the ray from the centre through r; the upper pole for the centre.
    [[nodiscard]] Eigen::Vector3d onto_surface(const Eigen::Vector3d& r) const noexcept;
    /// The surface point with all coordinates of r but one, for r inside (N < 1); the sign of the replaced
    /// one is kept.
    [[nodiscard]] Eigen::Vector3d along_axis(const Eigen::Vector3d& r, int axis) const noexcept;

    /// The surface point furthest along `direction` (any length, not zero), in closed form: the gradient of
    /// the dual norm, whose exponents are 1 / (1 - 1/p). Where a whole face or edge is, its middle. 10 ns for
    /// ellipsoids, 150 for others.
    [[nodiscard]] Eigen::Vector3d support(const Eigen::Vector3d& direction) const noexcept;

    /// A surface point near the closest one to r outside: along the ray for a round profile, for a flat one
    /// (e1 < 0.6) that of r brought into the straight prism, each of height and cross-section by itself.
    [[nodiscard]] Eigen::Vector3d near_outside(const Eigen::Vector3d& r) const noexcept;

    [[nodiscard]] const Eigen::Vector3d& semi_axes() const noexcept { return semi_axes_; }  ///< (a, b, c) [m]
    [[nodiscard]] double e1() const noexcept { return e1_; }                                ///< as clamped
    [[nodiscard]] double e2() const noexcept { return e2_; }                                ///< as clamped
    /// Radius of a sphere about the centre that holds the body [m].
    [[nodiscard]] double bounding_radius() const noexcept { return bounding_radius_; }

private:
    [[nodiscard]] GaugeDerivatives derivatives(const Eigen::Vector3d& r, double curve1,
                                               double curve2) const noexcept;

    Eigen::Vector3d semi_axes_;
    double e1_, e2_, p1_, p2_;
    double bounding_radius_;
};

}  // namespace sim
