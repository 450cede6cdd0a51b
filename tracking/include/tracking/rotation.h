#pragma once
#include <Eigen/Geometry>

namespace tracking {

/// Unit quaternion of the rotation by |v| about v [rad]: (cos(|v|/2), sin(|v|/2) v/|v|) (Friedmann
/// 1992, 3.21-3.22 with the sine and cosine in their places).
[[nodiscard]] Eigen::Quaterniond exponential(const Eigen::Vector3d& v) noexcept;

/// Rotation vector of the shorter of the two ways that q stands for, |v| <= pi. Inverse of exponential().
[[nodiscard]] Eigen::Vector3d logarithm(const Eigen::Quaterniond& q) noexcept;

/// Shortest rotation that turns the direction of `from` into that of `to`, neither of them zero; a half turn about
/// some axis across `from` where they are opposite. As Eigen's FromTwoVectors, which needs a singular value
/// decomposition for that case alone and takes seconds to compile wherever it stands.
[[nodiscard]] Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from,
                                                  const Eigen::Vector3d& to) noexcept;

}  // namespace tracking
