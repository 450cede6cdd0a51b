#pragma once
#include <string>

namespace render::shaders {

/// The number of balls that darken the floor under the objects; larger ones first.
inline constexpr int kMaxBalls = 32;

// GLSL 3.30. Attribute numbers: SceneGeometry. The objects' and the baking shaders compute in linear light
// and write display values (sRGB); the floor's and the backdrop's put display values together.
[[nodiscard]] std::string shadow_vertex(bool bending);
[[nodiscard]] std::string shadow_fragment();
[[nodiscard]] std::string object_vertex(bool bending);
[[nodiscard]] std::string object_fragment(bool coarse);
[[nodiscard]] std::string floor_vertex();
[[nodiscard]] std::string floor_fragment();
[[nodiscard]] std::string floor_bake_fragment();
[[nodiscard]] std::string backdrop_vertex();
[[nodiscard]] std::string backdrop_bake_fragment();
[[nodiscard]] std::string backdrop_fragment();

}  // namespace render::shaders
