#pragma once
#include <filesystem>

#include "render/mesh.h"

namespace render {

/// Imports a file with assimp in this process: triangles only, node transforms applied, one part a material,
/// normals made where the file has none. Meant for the importing child alone: malformed files may crash it.
/// Throws std::runtime_error with "found ..., expected ...".
[[nodiscard]] Mesh import_with_assimp(const std::filesystem::path& file);

}  // namespace render
