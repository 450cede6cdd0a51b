#pragma once
#include <array>
#include <cstddef>
#include <span>

namespace audio {

/// Keeps stereo below a true peak: what comes is delayed by kDelay samples, so that the gain is down before a peak arrives.
/// True peaks are those of four times as many samples (ITU-R BS.1770-4, annex 2, whose filter it is). The gain that each
/// sample needs, g = ceiling / peak, goes through a minimum over kWindow samples, a return towards 1 with the time constant
/// kReleaseS, and a mean over kWindow: for every peak each term of its mean has that peak in its minimum, so none gets
/// through, and the gain has no steps. Both sides have one gain. Sound that needs none is only delayed, to the bit.
///
/// No allocation; one thread at a time.
class Limiter {
public:
    static constexpr std::size_t kDelay = 64;
    static constexpr double kCeilingDbtp = -1, kReleaseS = 0.1;

    Limiter();
    /// Interleaved stereo, in place.
    void limit(std::span<float> interleaved) noexcept;

private:
    static constexpr std::size_t kTaps = 12, kPhases = 4;
    static constexpr std::size_t kHalf = kTaps / 2;  // delay of the interpolation
    static constexpr std::size_t kWindow = kDelay - kHalf + 1;
    static constexpr std::size_t kRing = 128;  // above kDelay and kWindow

    [[nodiscard]] float true_peak() const noexcept;

    std::array<std::array<float, kRing>, 2> came_{};
    std::array<float, kRing> needed_{}, returned_{};
    float gain_ = 1;           // after the return
    std::size_t at_ = 0;       // of all rings
    std::size_t reduced_ = 0;  // samples until no ring holds a gain below 1
};

}  // namespace audio
