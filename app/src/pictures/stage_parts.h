#pragma once
#include <render/scene.h>

#include <Eigen/Core>

namespace app {

// What the stages of kits and of scenes share.

/// Polished wood of a colour (linear RGB).
[[nodiscard]] inline render::Look wood(float red, float green, float blue, float roughness) {
    return {{Eigen::Vector3f(red, green, blue), 0.0f, roughness}, {}};
}

/// The matrix that takes r to linear r + place; `place` [m].
[[nodiscard]] inline Eigen::Matrix4f affine_matrix(const Eigen::Matrix3d& linear,
                                                   const Eigen::Vector3d& place) {
    Eigen::Matrix4f matrix = Eigen::Matrix4f::Identity();
    matrix.topLeftCorner<3, 3>() = linear.cast<float>();
    matrix.topRightCorner<3, 1>() = place.cast<float>();
    return matrix;
}

}  // namespace app
