#pragma once
#include <Eigen/Geometry>

namespace tracking {

/// Unit quaternion of the rotation by |v| about v [rad]: (cos(|v|/2), sin(|v|/2) v/|v|) (Friedmann
/// 1992, 3.21-3.22 with the sine and cosine in their places).
[[nodiscard]] Eigen::Quaterniond exponential(const Eigen::Vector3d& v) noexcept;

/// Rotation vector of the shorter of the two ways that q stands for, |v| <= pi. Inverse of exponential().
[[nodiscard]] Eigen::Vector3d logarithm(const Eigen::Quaterniond& q) noexcept;

}  // namespace tracking
