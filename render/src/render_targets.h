#pragma once
#include "changes.h"
#include "gl_functions.h"
#include "gl_program.h"
#include "render/scene.h"
#include "tile_mask.h"
#include "tile_quads.h"

namespace render {

/// A texture read texel by texel: GL_RGBA8 for display colours, GL_RG16, GL_R32F, GL_DEPTH_COMPONENT32F.
[[nodiscard]] GLuint make_texture(const GlFunctions& gl, GLenum format, int width, int height);
/// Bound.
[[nodiscard]] GLuint make_framebuffer(const GlFunctions& gl);
/// Throws std::runtime_error unless the bound framebuffer is complete.
void require_complete(const GlFunctions& gl, const char* what, int width, int height);

/// The framebuffers of one picture, which is drawn tile by tile. What the objects' surfaces are is drawn with
/// several samples per pixel over nothing (all 0), and kept with its depths; a second pass, once per pixel,
/// puts them in their light before the background. Tiles that are not drawn keep samples and pixels. End with
/// their context.
class PictureTarget {
public:
    /// Throws std::runtime_error when the framebuffer cannot be made.
    PictureTarget(const GlFunctions& gl, int width, int height, bool multisampling);

    /// For the uniforms that the renderer sets in all shaders.
    [[nodiscard]] const GlProgram& program() const { return tile_program_; }
    /// Of the samples in a pixel, (x, y) of two in each [pixels].
    [[nodiscard]] const std::vector<Eigen::Vector4f>& sample_places() const { return sample_places_; }

    /// Empties the mask's tiles; objects are drawn from now on. Where one reaches beyond these tiles, it must
    /// be as it was when it was drawn there: nothing changes then, as only what is nearer is drawn.
    void begin_objects(const TileMask& mask);
    /// Binds what the objects' surfaces are (folded normals; direction of the grooves and part) and their
    /// depths to the texture units.
    void bind(GLuint normals_unit, GLuint surfaces_unit, GLuint depths_unit) const;
    /// From now on pixels are drawn (no depth), by the tiles' rectangles.
    [[nodiscard]] const TileQuads& begin_picture(const TileMask& mask);
    /// Takes the pixels of a box, when they are drawn.
    void read(const PixelBox& box);
    /// The picture as the boxes read made it, top row first.
    void give(Image& image);

private:
    [[nodiscard]] GLuint attach_texture(GLenum point, GLenum format);

    const GlFunctions& gl_;
    int width_, height_;
    GlProgram tile_program_;
    TileQuads quads_;
    GLenum kind_;  ///< of the textures
    GLuint objects_ = 0, picture_ = 0, normals_ = 0, surfaces_ = 0, depths_ = 0;
    std::vector<Eigen::Vector4f> sample_places_;
    PixelBox box_;                    ///< read last, and not yet put into the picture
    std::vector<std::uint8_t> rgba_;  ///< of the box, bottom row first
    std::vector<std::uint8_t> rgb_;   ///< of the picture, top row first
};

/// A depth picture seen from the light, for comparison look-ups. Ends with its context.
class ShadowTarget {
public:
    /// Size 0 keeps one texel that is always lit.
    ShadowTarget(const GlFunctions& gl, int size);

    /// Draws go here from now on.
    void begin() const;
    /// Clears a box to "lit"; draws are cut to it.
    void begin(const PixelBox& box) const;
    void bind(GLuint unit) const;

    /// What is in the map is known from now on.
    void keep();
    /// Nothing is.
    void forget() { kept_.clear(); }
    /// Takes what is in boxes, when it is drawn.
    void read(const std::vector<PixelBox>& boxes);
    /// Where the boxes read last differ from what was known, in blocks; that is known then.
    [[nodiscard]] std::vector<ShadowChange> changed();

private:
    void read(const PixelBox& box, float* depths) const;

    const GlFunctions& gl_;
    int size_;
    std::vector<float> kept_,
        drawn_;  ///< depths by row and column, of the map, and of one box after the other
    std::vector<PixelBox> boxes_;
    GLuint framebuffer_ = 0, texture_ = 0;
};

}  // namespace render
