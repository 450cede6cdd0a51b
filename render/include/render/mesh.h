#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

namespace render {

/// Triangles of one material of a mesh file. Metres, +y up, counter-clockwise seen from outside.
struct MeshPart {
    std::string material;
    std::vector<Eigen::Vector3f> positions, normals;  ///< same length; normals have unit length
    std::vector<std::uint32_t> indices;               ///< three per triangle
};
struct Mesh {
    std::vector<MeshPart> parts;
    [[nodiscard]] std::size_t triangles() const;
    [[nodiscard]] Eigen::AlignedBox3f bounds() const;
};

/// A file that is no mesh, or cannot be one here: one line, FILE[:LINE]: error: found ..., expected ...
/// Control characters in it, of what was found, become spaces.
class MeshError : public std::runtime_error {
public:
    explicit MeshError(std::string text);
};

/// Loads OBJ, GLB/glTF or STL. Plain OBJ, as assets/meshes holds, is read in this process; other files through
/// assimp in a child process with limits on memory, processor time and waiting time (malformed files crash or
/// hang that importer). Checked: finite values, index ranges, 1 to 500000 triangles. A part's material is the
/// file's material name (OBJ: usemtl, no .mtl needed); node transforms of glTF are applied. Throws
/// MeshError, and std::system_error where the child cannot be run. Any thread. Costs about 20 ms for a small file
/// that needs the child, nearly all of it the child's start.
[[nodiscard]] Mesh load_mesh(const std::filesystem::path& file);

/// The same for several files, in their order; the children run side by side. The first file that fails
/// throws.
[[nodiscard]] std::vector<Mesh> load_meshes(const std::vector<std::filesystem::path>& files);

}  // namespace render
