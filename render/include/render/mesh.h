#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace render {

/// Triangles of one material of a mesh file. Metres, +y up.
struct MeshPart {
    std::string material;
    std::vector<Eigen::Vector3f> positions, normals;  ///< same length
    std::vector<std::uint32_t> indices;               ///< three a triangle
};
struct Mesh {
    std::vector<MeshPart> parts;
    [[nodiscard]] std::size_t triangles() const;
    [[nodiscard]] Eigen::AlignedBox3f bounds() const;
};

/// Loads OBJ, GLB/glTF or STL through assimp, in a child process with limits on memory and processor time (malformed files crash or hang
/// the importer), and checks the result: finite values, index ranges, 1 to 500000 triangles.
/// Throws std::runtime_error with one line: FILE: error: found ..., expected ...
[[nodiscard]] Mesh load_mesh(const std::filesystem::path& file);

}  // namespace render
