#pragma once
#include "gl_functions.h"
#include "render/scene.h"

namespace render {

/// The framebuffers of one picture: colour and depth with several samples a pixel, and one sample a pixel to resolve into and read.
/// End with their context.
class PictureTarget {
public:
    /// Samples above what the device has are cut to that. Throws std::runtime_error when the framebuffer cannot be made.
    PictureTarget(const GlFunctions& gl, int width, int height, int samples);

    /// Draws go here from now on; depth is cleared, colour is not (every pixel gets drawn).
    void begin() const;
    /// Resolves the samples and copies the picture out, top row first.
    void read(Image& image);

private:
    const GlFunctions& gl_;
    int width_, height_;
    GLuint drawn_ = 0, resolved_ = 0;
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
