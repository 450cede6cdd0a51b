#pragma once
#include <vector>

#include "gl_functions.h"
#include "render/scene.h"

namespace render {

/// The mode shapes of all bending solids in one texture buffer that the vertex shader reads: a vertex has two
/// tangents whose cross product is its normal, then, a mode, its displacement and the changes of the two
/// tangents: the cross product of the changed tangents is cof(I + G) n exactly. Ends with its context.
class ModeTexture {
public:
    /// Throws std::runtime_error for shapes that do not fit their mesh, and for more than the buffer holds.
    ModeTexture(const GlFunctions& gl, const std::vector<Solid>& solids);

    [[nodiscard]] bool empty() const { return buffer_ == 0; }
    void bind(GLuint unit) const;

    // Of a solid; 0 for -1 (a mesh of a file) and for rigid ones.
    [[nodiscard]] int count(int solid) const { return solid < 0 ? 0 : at(solid).count; }
    [[nodiscard]] GLint first_texel(int solid) const { return solid < 0 ? 0 : at(solid).first_texel; }
    [[nodiscard]] GLint texels_a_vertex(int solid) const {
        return count(solid) > 0 ? 2 + 3 * count(solid) : 0;
    }

private:
    struct Place {
        int count;
        GLint first_texel;
    };
    [[nodiscard]] const Place& at(int solid) const { return places_[static_cast<std::size_t>(solid)]; }

    const GlFunctions& gl_;
    std::vector<Place> places_;
    GLuint buffer_ = 0, texture_ = 0;
};

}  // namespace render
