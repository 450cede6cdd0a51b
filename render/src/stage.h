#pragma once
#include <vector>

#include "gl_functions.h"
#include "gl_program.h"
#include "render/scene.h"

namespace render {

/// The floor (planks that fade into the wall with distance) and the wall behind. The camera and the light
/// stand still, so both are shaded once: one picture in the key light, one in its shadow. A frame blends them
/// by its shadow map, darkens the floor under the objects, and lays the objects' picture over it. Ends with
/// its context.
class Stage {
public:
    Stage(const GlFunctions& gl, const SceneDescription& scene);

    /// All programs, for the uniforms that the renderer sets in all shaders. Then bake().
    [[nodiscard]] std::vector<const GlProgram*> programs() const;
    void bake(GLuint lit_unit, GLuint dark_unit);

    /// Every pixel of the bound framebuffer. The objects' picture and the shadow map are bound to the units
    /// that the uniforms name.
    void draw(const std::vector<Eigen::Vector4f>& balls) const;

private:
    void make_floor(const Eigen::Vector3f& center);
    void bake_one(GLuint texture, float key_part) const;
    void draw_shapes(const GlProgram& backdrop, const GlProgram& floor) const;

    const GlFunctions& gl_;
    int width_, height_;
    GlProgram floor_bake_, backdrop_bake_, floor_, backdrop_;
    GLuint floor_array_ = 0, empty_array_ = 0;
    GLsizei floor_indices_ = 0;
    GLuint lit_texture_, dark_texture_;
};

}  // namespace render
