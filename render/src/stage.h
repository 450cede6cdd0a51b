#pragma once
#include "gl_functions.h"
#include "gl_program.h"
#include "render/scene.h"

namespace render {

/// The floor (planks that fade into the wall with distance, darkened under the objects) and the wall behind. Ends with its context.
class Stage {
public:
    Stage(const GlFunctions& gl, const SceneDescription& scene);

    /// After the objects: what they hide is not shaded. Both programs' common uniforms are set by the renderer.
    void draw(const std::vector<Eigen::Vector4f>& balls) const;

    [[nodiscard]] const GlProgram& floor_program() const { return floor_program_; }
    [[nodiscard]] const GlProgram& backdrop_program() const { return backdrop_program_; }

private:
    const GlFunctions& gl_;
    GlProgram floor_program_, backdrop_program_;
    GLuint floor_array_ = 0, empty_array_ = 0;
    GLsizei floor_indices_ = 0;
};

}  // namespace render
