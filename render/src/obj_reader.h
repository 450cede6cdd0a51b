#pragma once
#include <filesystem>
#include <optional>
#include <string_view>

#include "render/mesh.h"

namespace render {

/// Reads the plain OBJ that this project writes, in this process, trusting nothing:
///   v X Y Z [m]   vn X Y Z   f A//N B//M C//O (counted from 1)   usemtl NAME   o, g, s and # comments
/// One part a material, in the names' order; a vertex for each pair of a position and a normal that occurs.
/// Nothing: the file has a statement or a form of `f` that is not among these (polygons, texture
/// coordinates, no normals, indices from the end), so it is for the importer. Throws MeshError
/// "FILE:LINE: error: found ..., expected ..." for a number that is none or not finite, a coordinate beyond
/// kMaxCoordinate, a normal without length, an index that no line before has, and more than kMaxTriangles.
[[nodiscard]] std::optional<Mesh> read_plain_obj(const std::filesystem::path& file, std::string_view text);

}  // namespace render
