#include "render_targets.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "shaders.h"

namespace render {
namespace {

// Sides of the blocks in which changes of the shadow map are told: at least so many texels, at most so many a
// side.
constexpr int kLeastBlock = 4, kMostBlocks = 256;

}  // namespace

void require_complete(const GlFunctions& gl, const char* what, int width, int height) {
    if (gl.CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) return;
    throw std::runtime_error(std::string("OpenGL: error: cannot make a framebuffer for a ") + what + " of " +
                             std::to_string(width) + "x" + std::to_string(height));
}

GLuint make_framebuffer(const GlFunctions& gl) {
    GLuint framebuffer = 0;
    gl.GenFramebuffers(1, &framebuffer);
    gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    return framebuffer;
}

GLuint make_texture(const GlFunctions& gl, GLenum format, int width, int height) {
    const bool depth = format == GL_DEPTH_COMPONENT32F, one = depth || format == GL_R32F;
    GLuint texture = 0;
    gl.GenTextures(1, &texture);
    gl.BindTexture(GL_TEXTURE_2D, texture);
    gl.TexImage2D(GL_TEXTURE_2D, 0, static_cast<GLint>(format), width, height, 0,
                  depth ? GL_DEPTH_COMPONENT
                  : one ? GL_RED
                        : GL_RGBA,
                  one ? GL_FLOAT : GL_UNSIGNED_BYTE, nullptr);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return texture;
}

PictureTarget::PictureTarget(const GlFunctions& gl, int width, int height, bool multisampling)
    : gl_(gl),
      width_(width),
      height_(height),
      tile_program_(gl, shaders::tile_vertex(), shaders::tile_fragment()),
      quads_(gl),
      kind_(multisampling ? GL_TEXTURE_2D_MULTISAMPLE : GL_TEXTURE_2D),
      rgb_(std::size_t{3} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
    picture_ = make_framebuffer(gl_);
    GLuint buffer = 0;
    gl_.GenRenderbuffers(1, &buffer);
    gl_.BindRenderbuffer(GL_RENDERBUFFER, buffer);
    gl_.RenderbufferStorageMultisample(GL_RENDERBUFFER, 0, GL_RGBA8, width_, height_);
    gl_.FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, buffer);
    require_complete(gl_, "picture", width, height);
    objects_ = make_framebuffer(gl_);
    normals_ = attach_texture(GL_COLOR_ATTACHMENT0, GL_RG16);
    surfaces_ = attach_texture(GL_COLOR_ATTACHMENT1, GL_RG16);
    depths_ = attach_texture(GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT32F);
    const GLenum both[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    gl_.DrawBuffers(2, both);
    require_complete(gl_, "picture", width, height);
    if (!multisampling) return;
    for (GLuint i = 0; i < shaders::kSamples; i += 2) {
        Eigen::Vector4f pair;
        gl_.GetMultisamplefv(GL_SAMPLE_POSITION, i, pair.data());
        gl_.GetMultisamplefv(GL_SAMPLE_POSITION, i + 1, pair.data() + 2);
        sample_places_.push_back(pair);
    }
}

/// To the bound framebuffer.
GLuint PictureTarget::attach_texture(GLenum point, GLenum format) {
    GLuint texture = 0;
    if (kind_ == GL_TEXTURE_2D) {
        texture = make_texture(gl_, format, width_, height_);
    } else {
        gl_.GenTextures(1, &texture);
        gl_.BindTexture(kind_, texture);
        gl_.TexImage2DMultisample(kind_, shaders::kSamples, format, width_, height_, GL_TRUE);
    }
    gl_.FramebufferTexture2D(GL_FRAMEBUFFER, point, kind_, texture, 0);
    return texture;
}

void PictureTarget::begin_objects(const TileMask& mask) {
    gl_.BindFramebuffer(GL_FRAMEBUFFER, objects_);
    gl_.Viewport(0, 0, width_, height_);
    quads_.take(mask);
    tile_program_.use();
    tile_program_.set("depth", 1.0f);
    gl_.DepthFunc(GL_ALWAYS);
    quads_.draw();
    gl_.DepthFunc(GL_LESS);
}

void PictureTarget::bind(GLuint normals_unit, GLuint surfaces_unit, GLuint depths_unit) const {
    gl_.ActiveTexture(GL_TEXTURE0 + normals_unit);
    gl_.BindTexture(kind_, normals_);
    gl_.ActiveTexture(GL_TEXTURE0 + surfaces_unit);
    gl_.BindTexture(kind_, surfaces_);
    gl_.ActiveTexture(GL_TEXTURE0 + depths_unit);
    gl_.BindTexture(kind_, depths_);
}

const TileQuads& PictureTarget::begin_picture(const TileMask& mask) {
    gl_.BindFramebuffer(GL_FRAMEBUFFER, picture_);
    gl_.Viewport(0, 0, width_, height_);
    quads_.take(mask);
    return quads_;
}

void PictureTarget::read(const PixelBox& box) {
    box_ = box;
    if (box.empty()) return;
    rgba_.resize(4 * static_cast<std::size_t>(box.area()));
    gl_.BindFramebuffer(GL_READ_FRAMEBUFFER, picture_);
    gl_.ReadPixels(box.left, box.bottom, box.right - box.left, box.top - box.bottom, GL_RGBA,
                   GL_UNSIGNED_BYTE, rgba_.data());
}

void PictureTarget::give(Image& image) {
    const auto width = static_cast<std::size_t>(box_.right - box_.left);
    for (int y = box_.bottom; y < box_.top && width > 0; ++y) {
        const std::uint8_t* from = rgba_.data() + 4 * width * static_cast<std::size_t>(y - box_.bottom);
        std::uint8_t* to =
            rgb_.data() + 3 * (static_cast<std::ptrdiff_t>(height_ - 1 - y) * width_ + box_.left);
        // Four bytes at a time, the fourth overwritten by the next pixel; the last pixel of a row has room
        // for three.
        for (std::size_t x = 0; x + 1 < width; ++x, from += 4, to += 3) std::copy_n(from, 4, to);
        std::copy_n(from, 3, to);
    }
    box_ = {};
    image.width = width_;
    image.height = height_;
    image.rgb = rgb_;
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
    gl_.Disable(GL_SCISSOR_TEST);
    gl_.Clear(GL_DEPTH_BUFFER_BIT);
}

void ShadowTarget::begin() const {
    gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
    gl_.Viewport(0, 0, size_, size_);
}

void ShadowTarget::begin(const PixelBox& box) const {
    gl_.Scissor(box.left, box.bottom, box.right - box.left, box.top - box.bottom);
    gl_.Clear(GL_DEPTH_BUFFER_BIT);
}

void ShadowTarget::bind(GLuint unit) const {
    gl_.ActiveTexture(GL_TEXTURE0 + unit);
    gl_.BindTexture(GL_TEXTURE_2D, texture_);
}

void ShadowTarget::read(const PixelBox& box, float* depths) const {
    gl_.BindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_);
    gl_.ReadPixels(box.left, box.bottom, box.right - box.left, box.top - box.bottom, GL_DEPTH_COMPONENT,
                   GL_FLOAT, depths);
}

void ShadowTarget::keep() {
    if (!kept_.empty()) return;
    kept_.resize(static_cast<std::size_t>(size_) * static_cast<std::size_t>(size_));
    read({0, 0, size_, size_}, kept_.data());
}

void ShadowTarget::read(const std::vector<PixelBox>& boxes) {
    boxes_ = boxes;
    std::size_t texels = 0, at = 0;
    for (const PixelBox& box : boxes) texels += static_cast<std::size_t>(box.area());
    drawn_.resize(texels);
    for (const PixelBox& box : boxes) {
        read(box, drawn_.data() + at);
        at += static_cast<std::size_t>(box.area());
    }
}

std::vector<ShadowChange> ShadowTarget::changed() {
    const int block = std::max(kLeastBlock, size_ / kMostBlocks);
    std::vector<ShadowChange> changes;
    const float* of_box = drawn_.data();
    for (const PixelBox& box : boxes_) {
        for (int bottom = box.bottom; bottom < box.top; bottom += block)
            for (int left = box.left; left < box.right; left += block) {
                const PixelBox part{left, bottom, std::min(left + block, box.right),
                                    std::min(bottom + block, box.top)};
                float nearest = 2, farthest = -1;
                for (int y = part.bottom; y < part.top; ++y) {
                    float* kept = kept_.data() + static_cast<std::ptrdiff_t>(y) * size_;
                    const float* drawn =
                        of_box + static_cast<std::ptrdiff_t>(y - box.bottom) * (box.right - box.left) -
                        box.left;
                    for (int x = part.left; x < part.right; ++x) {
                        if (kept[x] == drawn[x]) continue;
                        nearest = std::min({nearest, kept[x], drawn[x]});
                        farthest = std::max({farthest, kept[x], drawn[x]});
                        kept[x] = drawn[x];
                    }
                }
                if (nearest <= farthest) changes.push_back({part, 2 * nearest - 1, 2 * farthest - 1});
            }
        of_box += box.area();
    }
    return changes;
}

}  // namespace render
