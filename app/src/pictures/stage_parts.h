#pragma once
#include <render/scene.h>
#include <sim/modes.h>

#include <Eigen/Core>
#include <span>

namespace app {

// What the stages of kits and of scenes and the pictures of modes share.

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

/// How the first `count` modes move vertices at these places of the body.
[[nodiscard]] inline render::ModeShapes shapes_at(std::span<const Eigen::Vector3d> vertices,
                                                  const sim::ModalBasis& basis, int count) {
    render::ModeShapes shapes;
    shapes.count = count;
    for (const Eigen::Vector3d& r : vertices)
        for (int k = 0; k < count; ++k) {
            const sim::Displacement u = sim::displacement_at(basis, basis.nodal.col(k), r);
            shapes.displacement.push_back(u.value.cast<float>());
            shapes.gradient.push_back(u.gradient.cast<float>());
        }
    return shapes;
}

}  // namespace app
