#pragma once
#include "render/scene.h"

namespace render {

/// Clip space (OpenGL: x right, y up, z in [-1, 1]) from world, for a camera. Near plane 0.05 m, far plane 60 m.
[[nodiscard]] Eigen::Matrix4f clip_from_world(const Camera& camera, float aspect);

/// Half of the side of the square the shadow map covers, across the light: what the camera sees at its
/// target's distance, and a margin.
[[nodiscard]] float shadow_reach(const Camera& camera, float aspect);

/// Clip space of the light (parallel rays), centred on the camera's target, `reach` to each side.
[[nodiscard]] Eigen::Matrix4f light_from_world(const KeyLight& light, const Eigen::Vector3f& center,
                                               float reach);

}  // namespace render
