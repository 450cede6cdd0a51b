#pragma once
#include <string>

namespace render::shaders {

/// Samples a pixel with multisampling.
inline constexpr int kSamples = 4;
/// Where the place of a pixel on a triangle moves faster through the shadow map, from one pixel to the next, the
/// triangle is seen from its edge. [texels]
inline constexpr float kMostChange = 100;
/// How far from its place a look-up reads the shadow map: 2 by the filter, half a texel as a texel is covered by its
/// middle, and as the place itself is known to 1/256 pixel, in which it changes by at most kMostChange / 256. [texels]
inline constexpr float kShadowFilter = 3.0f;
/// How far beyond an object's box in the shadow map a pixel's place may lie on it: the middle of a pixel that the
/// object covers in part lies outside it. [texels]
inline constexpr float kBeyondObject = 4.0f;
/// The number of balls that darken the floor under the objects; larger ones first.
inline constexpr int kMaxBalls = 32;

// GLSL 3.30. Attribute numbers: SceneGeometry. The objects' and the baking shaders compute in linear light
// and write display values (sRGB); the picture's puts display values together.
[[nodiscard]] std::string shadow_vertex(bool bending);
[[nodiscard]] std::string shadow_fragment();
[[nodiscard]] std::string object_vertex(bool bending);
[[nodiscard]] std::string object_fragment(bool coarse);
[[nodiscard]] std::string floor_vertex();
[[nodiscard]] std::string floor_bake_fragment();
[[nodiscard]] std::string floor_open_fragment();
[[nodiscard]] std::string backdrop_vertex();
[[nodiscard]] std::string backdrop_bake_fragment();
[[nodiscard]] std::string tile_vertex();
[[nodiscard]] std::string tile_fragment();
[[nodiscard]] std::string picture_fragment(bool multisampling);

}  // namespace render::shaders
