// What the process that reads other people's meshes hands over.
#include "mesh_stream.h"

#include "fuzz_target.h"

void fuzz_mesh_stream(std::string_view bytes) {
    try {
        const std::string text(bytes);
        const render::Mesh mesh = render::decode_mesh_stream(text);
        for (const render::MeshPart& part : mesh.parts)
            for (const std::uint32_t index : part.indices)
                require(index < part.positions.size(), "an index out of range");
    } catch (const std::runtime_error&) {
    }
}
