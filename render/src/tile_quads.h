#pragma once
#include "gl_functions.h"
#include "tile_mask.h"

namespace render {

/// Draws a mask's tiles as rectangles of whole pixels, with a program whose vertex shader is
/// shaders::tile_vertex(). Ends with its context.
class TileQuads {
public:
    explicit TileQuads(const GlFunctions& gl);
    void take(const TileMask& mask);
    void draw() const;

private:
    const GlFunctions& gl_;
    GLuint vertex_array_ = 0, buffer_ = 0;
    GLsizei vertices_ = 0;
};

}  // namespace render
