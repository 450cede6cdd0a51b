#pragma once
#include <chrono>
#include <memory>

#include "render/scene.h"

namespace render {

/// When a frame was drawn (all commands done), and when its pixels were in memory.
struct DrawTimes {
    std::chrono::steady_clock::time_point drawn, read;
};

/// Draws a scene off screen, with OSMesa, or with EGL where the environment variable MUSICWORLD_GL is egl.
/// Owns the one context of its thread: construct, use and destroy it on one thread. Throws std::runtime_error
/// ("FILE: error: found ..., expected ...") for a mesh that is missing, malformed or too large, and if no
/// context can be made.
class Renderer {
public:
    explicit Renderer(const SceneDescription& scene);
    ~Renderer();
    Renderer(const Renderer&) = delete;
    Renderer& operator=(const Renderer&) = delete;

    /// Draws one frame. The same state gives the same bytes, whatever was drawn before: of the picture
    /// before, what cannot have changed is kept.
    DrawTimes draw(const FrameState& frame, Image& image);
    /// The same for frames that follow each other, both cores at work: begins with this one, and gives the
    /// picture of the one that a call before has begun. False: there is none.
    [[nodiscard]] bool draw_next(const FrameState& frame, Image& before);
    /// The picture of the frame begun last. False: there is none, or it was given already.
    bool finish(Image& image);
    /// Nothing is kept for the next frame.
    void forget();

    /// "OSMesa 22.3.6, llvmpipe ..." for reports.
    [[nodiscard]] std::string version() const;
    [[nodiscard]] std::size_t triangles() const;

private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

/// PNG files of images that follow each other: SUB filter, deflate by ISA-L at level 1 (fast; the bytes, not
/// the pixels, depend on the processor's kind). Bands of rows are compressed apart, so that those equal to
/// the image before are taken from it; the bytes do not depend on that image.
class PngEncoder {
public:
    [[nodiscard]] std::vector<std::uint8_t> encode(Image image);

private:
    static constexpr std::size_t kBandRows = 16;
    struct Band {
        std::vector<std::uint8_t> deflated;
        std::uint32_t adler = 1;  ///< of its bytes before compression
    };
    Image before_;
    std::vector<Band> bands_;
    std::vector<std::uint8_t> lines_, work_;
};

/// Of one image.
[[nodiscard]] std::vector<std::uint8_t> encode_png(const Image& image);
/// The inverse, for tests and reports; throws std::runtime_error.
[[nodiscard]] Image decode_png(const std::vector<std::uint8_t>& bytes);

}  // namespace render
