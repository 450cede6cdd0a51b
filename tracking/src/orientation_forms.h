#pragma once
#include <Eigen/Geometry>
#include <string>

namespace tracking {

/// Intrinsic turns by `angles` [rad] about the body's x, y and z axes, in the order of `order`, a
/// permutation of "XYZ": "XYZ" is q_x q_y q_z. (Extrinsic turns are intrinsic ones in the opposite order.)
[[nodiscard]] Eigen::Quaterniond from_euler(const Eigen::Vector3d& angles, const std::string& order);

/// The coordinates of a z-up world in the y-up one: (x, y, z) becomes (x, z, -y). Body axes stay.
[[nodiscard]] Eigen::Vector3d from_z_up(const Eigen::Vector3d& v);
[[nodiscard]] Eigen::Quaterniond from_z_up(const Eigen::Quaterniond& q);

}  // namespace tracking
