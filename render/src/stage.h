#pragma once
#include <optional>
#include <vector>

#include "gl_functions.h"
#include "gl_program.h"
#include "render/scene.h"
#include "tile_quads.h"

namespace render {

/// The floor (planks that fade into the wall with distance) and the wall behind. While the camera stands still,
/// both are shaded once: one picture in the key light, one in its shadow; and how far objects darken the floor
/// under them is drawn when these move. A frame's tiles blend the two by the shadow map and
/// lay the objects over them, whose surfaces they put in their light. Ends with its context.
class Stage {
public:
    Stage(const GlFunctions& gl, const SceneDescription& scene,
          const std::vector<Eigen::Vector4f>& sample_places);

    /// All programs, for the uniforms that the renderer sets in all shaders. Then bake(), for each camera anew.
    [[nodiscard]] std::vector<const GlProgram*> programs() const;
    void bake(const Eigen::Matrix4f& clip_from_world, GLuint lit_unit, GLuint dark_unit, GLuint open_unit);

    /// Darkens the floor under the balls (centre, radius [m]). True: these have changed, so the floor has.
    bool darken(const std::vector<Eigen::Vector4f>& balls);
    /// Every pixel of the tiles. The objects' surfaces, their depths, the parts and the shadow map are bound to the units
    /// that the uniforms name.
    void draw(const TileQuads& tiles) const;
    /// The same for tiles that no object reaches.
    void draw_background(const TileQuads& tiles) const;

private:
    void make_floor(const Eigen::Vector3f& center);
    void begin(GLuint framebuffer) const;
    void set_rays(const GlProgram& program, const Eigen::Matrix4f& clip_from_world) const;
    [[nodiscard]] GLuint framebuffer_of(GLuint texture) const;
    void bake_one(GLuint framebuffer, float key_part) const;
    void draw_floor() const;

    const GlFunctions& gl_;
    int width_, height_;
    GlProgram floor_bake_, backdrop_bake_, open_, background_, picture_;
    GLuint floor_array_ = 0, empty_array_ = 0;
    GLsizei floor_indices_ = 0;
    GLuint lit_texture_, dark_texture_, open_texture_;
    GLuint lit_framebuffer_, dark_framebuffer_, open_framebuffer_;
    std::optional<std::vector<Eigen::Vector4f>> balls_;
};

}  // namespace render
