#pragma once
#include "gl_functions.h"
#include "render/scene.h"

namespace render {

/// A texture of 8-bit display colours, read texel by texel.
[[nodiscard]] GLuint make_color_texture(const GlFunctions& gl, int width, int height);
[[nodiscard]] GLuint make_framebuffer(const GlFunctions& gl);  ///< bound
/// Throws std::runtime_error unless the bound framebuffer is complete.
void require_complete(const GlFunctions& gl, const char* what, int width, int height);

/// The framebuffers of one picture. The objects are drawn with several samples per pixel over nothing (all
/// 0), resolved into a texture, and a second pass with one sample per pixel puts them before the background:
/// the background costs no samples. End with their context.
class PictureTarget {
public:
    /// Samples above what the device has are cut to that. Throws std::runtime_error when the framebuffer
    /// cannot be made.
    PictureTarget(const GlFunctions& gl, int width, int height, int samples);

    /// Cleared; objects are drawn from now on.
    void begin_objects() const;
    /// Resolves the objects' samples into the texture of this unit; from now on the background is drawn
    /// (every pixel, no depth).
    void begin_background(GLuint objects_unit) const;
    /// Copies the picture out, top row first.
    void read(Image& image);

private:
    const GlFunctions& gl_;
    int width_, height_;
    GLuint sampled_ = 0, objects_ = 0,
           picture_ = 0;  ///< framebuffers; the first two are the same without multisampling
    GLuint objects_texture_ = 0;
    std::vector<std::uint8_t> rgba_;  ///< bottom row first
};

/// A depth picture seen from the light, for comparison look-ups. Ends with its context.
class ShadowTarget {
public:
    /// Size 0 keeps one texel that is always lit.
    ShadowTarget(const GlFunctions& gl, int size);

    /// Cleared to "lit"; draws go here from now on.
    void begin() const;
    void bind(GLuint unit) const;

private:
    const GlFunctions& gl_;
    int size_;
    GLuint framebuffer_ = 0, texture_ = 0;
};

}  // namespace render
