#pragma once
#include <Eigen/Core>
#include <algorithm>

#include "sim/simulation.h"

namespace sim {

/// The cubic Hermite piece between two nodes of a path, in Bezier form: with h = t1 - t0, s = (t - t0) / h,
///   b0 = p0,  b1 = p0 + h v0 / 3,  b2 = p1 - h v1 / 3,  b3 = p1
///   p(t) = (1 - s)^3 b0 + 3 (1 - s)^2 s b1 + 3 (1 - s) s^2 b2 + s^3 b3,  exact at both nodes.
/// The piece lies in the hull of its control points, and its velocity in that of their differences times 3 / h.
struct HermitePiece {
    double t0_s, t1_s;           ///< t1 > t0
    Eigen::Vector3d control[4];  ///< b0 to b3 [m], in the frame of the nodes

    HermitePiece(const PathNode& from, const PathNode& to)
        : t0_s(from.t_s),
          t1_s(to.t_s),
          control{from.position, from.position + (to.t_s - from.t_s) / 3 * from.velocity,
                  to.position - (to.t_s - from.t_s) / 3 * to.velocity, to.position} {}

    [[nodiscard]] Eigen::Vector3d position(double t_s) const {
        const double s = (t_s - t0_s) / (t1_s - t0_s), r = 1 - s;
        return r * r * r * control[0] + 3 * r * r * s * control[1] + 3 * r * s * s * control[2] +
               s * s * s * control[3];
    }
    [[nodiscard]] Eigen::Vector3d velocity(double t_s) const {
        const double s = (t_s - t0_s) / (t1_s - t0_s), r = 1 - s;
        return 3 / (t1_s - t0_s) *
               (r * r * (control[1] - control[0]) + 2 * r * s * (control[2] - control[1]) +
                s * s * (control[3] - control[2]));
    }
    /// No part of the piece moves faster [m/s].
    [[nodiscard]] double greatest_speed() const {
        return 3 / (t1_s - t0_s) *
               std::max({(control[1] - control[0]).norm(), (control[2] - control[1]).norm(),
                         (control[3] - control[2]).norm()});
    }
};

}  // namespace sim
