#pragma once
#include <render/scene.h>

#include <cstdint>
#include <vector>

namespace app {

/// Of how many moments a picture with motion blur is the mean.
inline constexpr int kBlurMoments = 8;

/// When a picture shown at t_s with the shutter open for open_s is taken, in order: evenly over
/// (t_s - open_s, t_s], the last at t_s. One moment where open_s is 0.
[[nodiscard]] std::vector<double> exposure_times(double t_s, double open_s);

/// The state at a share (0 to 1) of the way from `a` to `b`, two states of one scene: places, stretches, modal
/// coordinates and the camera go straight, turns go evenly by the shorter way. An object that one of them does not
/// show, or that rests, is as in `b`.
[[nodiscard]] render::FrameState between(const render::FrameState& a, const render::FrameState& b,
                                         float share);

/// The mean of pictures of one size in linear light: bytes by the sRGB transfer (IEC 61966-2-1) to 16 bits, their
/// mean, and back to the nearest byte. The mean of equal bytes is that byte.
class LinearMean {
public:
    void add(const render::Image& picture);
    /// Of those added, at least one.
    [[nodiscard]] render::Image mean() const;

private:
    int width_ = 0, height_ = 0;
    std::uint32_t count_ = 0;
    std::vector<std::uint32_t> sums_;
};

}  // namespace app
