#pragma once
#include <Eigen/Core>

#include "shape/superquadric.h"
#include "sim/modal_body.h"

namespace sim {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Volume [m^3] and second moments of volume, the integrals of x^2, y^2, z^2 [m^5]; B: beta function (Jaklic,
/// Leonardis, Solina 2000, "Segmentation and Recovery of Superquadrics", 2.4.6, with y as the polar axis).
///   V = 2 a b c e1 e2 B(e1/2 + 1, e1) B(e2/2, e2/2)
///   integral of x^2 = 1/2 a^2 (a b c e1 e2) B(3 e2/2, e2/2) B(e1/2, 2 e1 + 1)     (z^2: c^2 for a^2)
///   integral of y^2 =     b^2 (a b c e1 e2) B(e2/2, e2/2) B(3 e1/2, e1 + 1)
struct VolumeMoments {
    double volume;
    Eigen::Vector3d second;
};
[[nodiscard]] VolumeMoments volume_moments(const Gauge& gauge);  ///< exact for the clamped exponents

/// The six uniform-strain modes of a solid: u = (D - I) r of (2.12).
///   kinetic energy  1/2 q_dot^T M q_dot,  M = diag(Jx, Jy, Jz, Jy + Jz, Jx + Jz, Jx + Jy), J = rho * second
///   strain energy   1/2 q^T K q,  scales: V (lambda 1 1^T + 2 mu I),  shears: 4 mu V
///   modes           K phi = omega^2 M phi  (2.5);  the columns of `strain_from_modal` are M-normalised
/// Canonical order: the scales' modes by frequency, then the shears yz, xz, xy. Each column's largest entry
/// is positive. A group of equal frequencies (to 1e-9) is spanned by the projections of the strain axes in
/// order. Solved once, at construction.
struct LinearBody {
    double mass = 0;             ///< [kg]
    Eigen::Vector3d moments;     ///< J [kg m^2]
    Vector6d omega;              ///< [rad/s]
    Matrix6d strain_from_modal;  ///< q = Phi z
    Matrix6d modal_from_strain;  ///< z = Phi^T M q
};
[[nodiscard]] LinearBody make_linear_body(const Gauge& gauge, const Material& material);  ///< in SI units

/// Generalised impulse of `impulse` at the rest point `r` on the strains: Q_i = J . du/dq_i  [N s m].
[[nodiscard]] Vector6d strain_impulse(const Eigen::Vector3d& impulse, const Eigen::Vector3d& r) noexcept;

}  // namespace sim
