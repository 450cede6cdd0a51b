#pragma once
#include <Eigen/Geometry>
#include <optional>
#include <string>

namespace tracking {

/// Intrinsic turns by `angles` [rad] about the body's x, y and z axes, in the order of `order`, a
/// permutation of "XYZ": "XYZ" is q_x q_y q_z. (Extrinsic turns are intrinsic ones in the opposite order.)
[[nodiscard]] Eigen::Quaterniond from_euler(const Eigen::Vector3d& angles, const std::string& order);

/// The coordinates of a z-up world in the y-up one: (x, y, z) becomes (x, z, -y). Body axes stay.
[[nodiscard]] Eigen::Vector3d from_z_up(const Eigen::Vector3d& v);
[[nodiscard]] Eigen::Quaterniond from_z_up(const Eigen::Quaterniond& q);

/// What is said of axes, of the world and of bodies alike: three letters for where x, y and z point (R or L
/// for right or left, U or D for up or down, F or B for forward or back), "unity" (RUF) or "unreal" (FRU).
/// The matrix M takes such coordinates to ours (RUB): p' = M p. Its columns are where the axes point, its
/// entries 0, 1 and -1; det M = -1 if the axes are left-handed. None for anything else.
[[nodiscard]] std::optional<Eigen::Matrix3d> axes_of(const std::string& frame);

/// The rotation in our coordinates, of world and body: R' = M R M^T. With N = det(M) M, which is a rotation,
/// R' = N R N^T turns by the same angle about N v where R turns about v: (w, v) becomes (w, det(M) M v).
[[nodiscard]] Eigen::Quaterniond from_axes(const Eigen::Matrix3d& m, const Eigen::Quaterniond& q);

}  // namespace tracking
