#pragma once
#include <string>

namespace render::shaders {

/// Samples a pixel with multisampling.
inline constexpr int kSamples = 4;
/// How far from its place a look-up reads the shadow map: 2 by the filter, half a texel as a texel is covered by its
/// middle. [texels]
inline constexpr float kShadowFilter = 2.5f;
/// By how much an object's shadow is widened (Shadow::widened): nearly the filter's reach, and less than the shift of
/// what looks up. [texels]
inline constexpr float kShadowWidening = 1.25f;
/// How far from where it is a surface's place lies at most that is computed from its depth: with a depth of 32 bits and
/// cameras up to a kilometre away. [texels of the shadow map]
inline constexpr float kPlaceError = 1.0f;
/// Different looks of parts, as 16 bits tell them apart; 0 is no part.
inline constexpr int kMostParts = 65535;
/// The number of balls that darken the floor under the objects; larger ones first.
inline constexpr int kMaxBalls = 32;

// GLSL 3.30. Attribute numbers: SceneGeometry. The objects' shaders write what is seen (normals, parts, depths); the
// picture's lights that, in linear light, and puts display values (sRGB) together. The baking shaders write display
// values.
[[nodiscard]] std::string shadow_vertex(bool bending);
[[nodiscard]] std::string shadow_fragment();
[[nodiscard]] std::string object_vertex(bool bending);
[[nodiscard]] std::string object_fragment();
[[nodiscard]] std::string floor_vertex();
[[nodiscard]] std::string floor_bake_fragment();
[[nodiscard]] std::string floor_open_fragment();
[[nodiscard]] std::string backdrop_vertex();
[[nodiscard]] std::string backdrop_bake_fragment();
[[nodiscard]] std::string tile_vertex();
[[nodiscard]] std::string tile_fragment();
[[nodiscard]] std::string background_fragment();
[[nodiscard]] std::string picture_fragment(bool multisampling, bool coarse);

}  // namespace render::shaders
