#pragma once
#include <string>

namespace render::shaders {

/// The number of balls that darken the floor under the objects; larger ones first.
inline constexpr int kMaxBalls = 32;

// GLSL 3.30. Attribute numbers: SceneGeometry. Colours are linear until the last line of each fragment shader.
[[nodiscard]] std::string shadow_vertex();
[[nodiscard]] std::string shadow_fragment();
[[nodiscard]] std::string object_vertex();
[[nodiscard]] std::string object_fragment();
[[nodiscard]] std::string floor_vertex();
[[nodiscard]] std::string floor_fragment();
[[nodiscard]] std::string backdrop_vertex();
[[nodiscard]] std::string backdrop_fragment();

}  // namespace render::shaders
