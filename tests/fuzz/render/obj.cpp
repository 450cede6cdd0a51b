// Plain OBJ, the only meshes that are read in the program's own process.
#include <cmath>

#include "fuzz_target.h"
#include "mesh_stream.h"
#include "obj_reader.h"

void fuzz_obj(std::string_view bytes) {
    try {
        const std::optional<render::Mesh> mesh = render::read_plain_obj("fuzz", bytes);
        if (!mesh) return;
        require(mesh->triangles() <= render::kMaxTriangles, "too many triangles");
        for (const render::MeshPart& part : mesh->parts) {
            require(part.positions.size() == part.normals.size(), "positions without normals");
            for (const std::uint32_t index : part.indices)
                require(index < part.positions.size(), "an index out of range");
            for (const Eigen::Vector3f& position : part.positions)
                require(position.cwiseAbs().maxCoeff() <= render::kMaxCoordinate, "a position out of range");
        }
    } catch (const std::runtime_error& fault) {
        require_located(fault, "fuzz");
    }
}
