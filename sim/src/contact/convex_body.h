#pragma once
#include "body/posed_body.h"

namespace sim {

/// A posed body as a convex set with a support mapping, for distances at any range (convex_distance.h):
///   body = core + ball of radius margin
/// The core's furthest point along d, D the deformation, F = I + du/dr:
///   rigid   s(d)                                s: of the superquadric, in closed form (Gauge::support)
///   linear  D s(D^T d)                          exact: the map is affine
///   modal   r + u(r),  r = s(F(s(d))^T d)       ellipsoids that are hardly bent; u to first order from s(d)
///           the furthest of the samples         others: the hull of the samples
/// Of an ellipsoid a ball as large as its smallest radius of curvature, a_min^2 / a_max, is taken out of the
/// core, so that two that overlap by less than their margins still have a distance and a normal. A body with
/// bumps is its base, grown by the highest: bounds it from outside.
/// Borrows the posed body. Pure, no allocation.
class ConvexBody {
public:
    /// inside: by how much the body is made smaller along every axis, less than the smallest semi-axis, for tests how deep
    /// two are in each other [m].
    explicit ConvexBody(const PosedBody& posed, double inside = 0) noexcept;

    struct Point {
        Eigen::Vector3d place;  ///< as deformed, body frame [m]
        Eigen::Vector3d rest;   ///< in the rest shape [m]
    };
    /// Furthest along a unit direction in the body frame.
    [[nodiscard]] Point support(const Eigen::Vector3d& direction) const noexcept;
    [[nodiscard]] double margin() const noexcept { return margin_; }  ///< [m]
    /// Of a ball about the centre that holds it [m].
    [[nodiscard]] double radius() const noexcept { return static_cast<double>(posed_->radius); }
    /// How far out of the line of its normal a surface point may be: a turn by dw moves the support plane of
    /// any direction by at most |dw| times this [m]. 0 for a rigid ball.
    [[nodiscard]] double turn_reach() const noexcept { return turn_reach_; }

private:
    [[nodiscard]] Point outer_support(const Eigen::Vector3d& direction) const noexcept;
    [[nodiscard]] Point round_support(const Eigen::Vector3d& direction) const noexcept;
    [[nodiscard]] Point sample_support(const Eigen::Vector3d& direction) const noexcept;

    const PosedBody* posed_;
    Eigen::Array3d scale_;  // of the axes
    bool inside_, hull_;    // made smaller; of samples
    double shrunk_ = 0, margin_ = 0, turn_reach_ = 0;
};

/// Whether contacts of this body are where its surface is nearest, one point, rather than samples: ellipsoids
/// that are not bent by more than 1 % of their smallest semi-axis by modes (uniform strains leave ellipsoids
/// what they are).
[[nodiscard]] bool is_round(const PosedBody& posed) noexcept;

/// Whether modes bend a body by more than 1 % of its smallest semi-axis.
[[nodiscard]] bool is_bent(const PosedBody& posed) noexcept;

/// Smallest radius of curvature of an ellipsoid at rest [m].
[[nodiscard]] double smallest_radius(const BodyKind& kind) noexcept;

/// sqrt(R^2 - r^2), R and r radii of balls about the centre that hold the rest shape and that it holds [m].
[[nodiscard]] double turn_reach_of(const BodyKind& kind) noexcept;

}  // namespace sim
