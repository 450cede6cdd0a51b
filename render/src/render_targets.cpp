#include "render_targets.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace render {

void require_complete(const GlFunctions& gl, const char* what, int width, int height) {
    if (gl.CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) return;
    throw std::runtime_error(std::string("OSMesa: error: cannot make a framebuffer for a ") + what + " of " +
                             std::to_string(width) + "x" + std::to_string(height));
}

GLuint make_framebuffer(const GlFunctions& gl) {
    GLuint framebuffer = 0;
    gl.GenFramebuffers(1, &framebuffer);
    gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    return framebuffer;
}

GLuint make_color_texture(const GlFunctions& gl, int width, int height) {
    GLuint texture = 0;
    gl.GenTextures(1, &texture);
    gl.BindTexture(GL_TEXTURE_2D, texture);
    gl.TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return texture;
}

PictureTarget::PictureTarget(const GlFunctions& gl, int width, int height, int samples)
    : gl_(gl),
      width_(width),
      height_(height),
      rgba_(std::size_t{4} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
    GLint most = 0;
    gl_.GetIntegerv(GL_MAX_SAMPLES, &most);
    const GLsizei used = samples <= 1 ? 0 : std::min(samples, most);
    const auto attach_buffer = [&](GLenum point, GLenum format, GLsizei count) {
        GLuint buffer = 0;
        gl_.GenRenderbuffers(1, &buffer);
        gl_.BindRenderbuffer(GL_RENDERBUFFER, buffer);
        gl_.RenderbufferStorageMultisample(GL_RENDERBUFFER, count, format, width_, height_);
        gl_.FramebufferRenderbuffer(GL_FRAMEBUFFER, point, GL_RENDERBUFFER, buffer);
    };
    picture_ = make_framebuffer(gl_);
    attach_buffer(GL_COLOR_ATTACHMENT0, GL_RGBA8, 0);
    require_complete(gl_, "picture", width, height);
    objects_texture_ = make_color_texture(gl_, width, height);
    sampled_ = objects_ = make_framebuffer(gl_);
    gl_.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, objects_texture_, 0);
    if (used > 0) {
        sampled_ = make_framebuffer(gl_);
        attach_buffer(GL_COLOR_ATTACHMENT0, GL_RGBA8, used);
    }
    attach_buffer(GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT32F, used);
    require_complete(gl_, "picture", width, height);
}

void PictureTarget::begin_objects() const {
    gl_.BindFramebuffer(GL_FRAMEBUFFER, sampled_);
    gl_.Viewport(0, 0, width_, height_);
    gl_.ClearColor(0, 0, 0, 0);
    gl_.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
}

void PictureTarget::begin_background(GLuint objects_unit) const {
    if (objects_ != sampled_) {
        gl_.BindFramebuffer(GL_READ_FRAMEBUFFER, sampled_);
        gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, objects_);
        gl_.BlitFramebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    }
    gl_.ActiveTexture(GL_TEXTURE0 + objects_unit);
    gl_.BindTexture(GL_TEXTURE_2D, objects_texture_);
    gl_.BindFramebuffer(GL_FRAMEBUFFER, picture_);
}

void PictureTarget::read(Image& image) {
    gl_.BindFramebuffer(GL_READ_FRAMEBUFFER, picture_);
    gl_.ReadPixels(0, 0, width_, height_, GL_RGBA, GL_UNSIGNED_BYTE, rgba_.data());
    image.width = width_;
    image.height = height_;
    const auto width = static_cast<std::size_t>(width_), height = static_cast<std::size_t>(height_);
    image.rgb.resize(3 * width * height);
    for (std::size_t y = 0; y < height; ++y) {
        const std::uint8_t* from = rgba_.data() + 4 * width * (height - 1 - y);
        std::uint8_t* to = image.rgb.data() + 3 * width * y;
        // Four bytes at a time, the fourth overwritten by the next pixel; the last pixel of a row has room
        // for three.
        for (std::size_t x = 0; x + 1 < width; ++x, from += 4, to += 3) std::copy_n(from, 4, to);
        std::copy_n(from, 3, to);
    }
}

ShadowTarget::ShadowTarget(const GlFunctions& gl, int size) : gl_(gl), size_(std::max(size, 1)) {
    gl_.GenTextures(1, &texture_);
    gl_.BindTexture(GL_TEXTURE_2D, texture_);
    gl_.TexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT32F, size_, size_, 0, GL_DEPTH_COMPONENT, GL_FLOAT,
                   nullptr);
    gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
    framebuffer_ = make_framebuffer(gl_);
    gl_.FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, texture_, 0);
    gl_.DrawBuffer(GL_NONE);
    gl_.ReadBuffer(GL_NONE);
    require_complete(gl_, "shadow", size_, size_);
    begin();
}

void ShadowTarget::begin() const {
    gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
    gl_.Viewport(0, 0, size_, size_);
    gl_.Clear(GL_DEPTH_BUFFER_BIT);
}

void ShadowTarget::bind(GLuint unit) const {
    gl_.ActiveTexture(GL_TEXTURE0 + unit);
    gl_.BindTexture(GL_TEXTURE_2D, texture_);
}

}  // namespace render
