#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "render/mesh.h"

namespace render {

/// A file with more triangles than this is refused.
inline constexpr std::size_t kMaxTriangles = 500000;
/// No coordinate may be farther from the origin than this [m].
inline constexpr float kMaxCoordinate = 1e5f;

/// Bytes in which the importing process hands a mesh to its parent on the same machine (host byte order):
///   "MWMESH1\n", u32 parts, then for each part u32 length and bytes of the name, u32 vertices, u32 indices,
///   positions, normals (3 floats each), indices (u32); "END\n".
/// or, for a file it could not read: "MWFAIL1\n" and a text "found ..., expected ...".
[[nodiscard]] std::string encode_mesh_stream(const Mesh& mesh);
[[nodiscard]] std::string encode_mesh_failure(const std::string& reason);

/// The inverse, trusting nothing: every length, index and value is checked.
/// Throws std::runtime_error with "found ..., expected ...", which is also how a failure stream is reported.
[[nodiscard]] Mesh decode_mesh_stream(const std::string& bytes);

}  // namespace render
