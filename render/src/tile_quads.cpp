#include "tile_quads.h"

#include <vector>

namespace render {

TileQuads::TileQuads(const GlFunctions& gl) : gl_(gl) {
    gl_.GenVertexArrays(1, &vertex_array_);
    gl_.BindVertexArray(vertex_array_);
    gl_.GenBuffers(1, &buffer_);
    gl_.BindBuffer(GL_ARRAY_BUFFER, buffer_);
    gl_.EnableVertexAttribArray(0);
    gl_.VertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, nullptr);
}

void TileQuads::take(const TileMask& mask) {
    std::vector<float> corners;
    for (const PixelBox& box : mask.runs()) {
        const auto left = static_cast<float>(box.left), right = static_cast<float>(box.right);
        const auto bottom = static_cast<float>(box.bottom), top = static_cast<float>(box.top);
        corners.insert(corners.end(),
                       {left, bottom, right, bottom, right, top, left, bottom, right, top, left, top});
    }
    vertices_ = static_cast<GLsizei>(corners.size() / 2);
    gl_.BindBuffer(GL_ARRAY_BUFFER, buffer_);
    gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(corners.size() * sizeof(float)), corners.data(),
                   GL_STREAM_DRAW);
}

void TileQuads::draw() const {
    gl_.BindVertexArray(vertex_array_);
    gl_.DrawArrays(GL_TRIANGLES, 0, vertices_);
}

}  // namespace render
