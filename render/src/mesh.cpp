#include "render/mesh.h"

namespace render {

std::size_t Mesh::triangles() const {
    std::size_t count = 0;
    for (const MeshPart& part : parts) count += part.indices.size() / 3;
    return count;
}

Eigen::AlignedBox3f Mesh::bounds() const {
    Eigen::AlignedBox3f box;
    for (const MeshPart& part : parts) {
        for (const Eigen::Vector3f& position : part.positions) box.extend(position);
    }
    return box;
}

}  // namespace render
