#include "limiter.h"

#include <algorithm>
#include <cmath>

#include "audio/performance.h"

namespace audio {
namespace {

// ITU-R BS.1770-4, annex 2: the first two phases of the interpolation by four; the others are these backwards.
constexpr std::array<std::array<float, 12>, 2> kInterpolation{
    {{0.0017089843750F, 0.0109863281250F, -0.0196533203125F, 0.0332031250000F, -0.0594482421875F,
      0.1373291015625F, 0.9721679687500F, -0.1022949218750F, 0.0476074218750F, -0.0266113281250F,
      0.0148925781250F, -0.0083007812500F},
     {-0.0291748046875F, 0.0292968750000F, -0.0517578125000F, 0.0891113281250F, -0.1665039062500F,
      0.4650878906250F, 0.7797851562500F, -0.2003173828125F, 0.1015625000000F, -0.0582275390625F,
      0.0330810546875F, -0.0189208984375F}}};

const float kCeiling = static_cast<float>(std::pow(10.0, Limiter::kCeilingDbtp / 20));
const auto kReturn = static_cast<float>(1 - std::exp(-1 / (Limiter::kReleaseS * kSampleRate)));

}  // namespace

Limiter::Limiter() {
    needed_.fill(1);
    returned_.fill(1);
}

/// Of both sides about the sample that came kHalf samples ago.
float Limiter::true_peak() const noexcept {
    float peak = 0;
    for (const std::array<float, kRing>& side : came_) {
        std::array<float, kPhases> sums{};
        for (std::size_t tap = 0; tap < kTaps; ++tap) {
            const float x = side[(at_ + kRing - tap) % kRing];
            for (std::size_t phase = 0; phase < 2; ++phase) {
                sums[phase] += kInterpolation[phase][tap] * x;
                sums[kPhases - 1 - phase] += kInterpolation[phase][kTaps - 1 - tap] * x;
            }
        }
        for (const float sum : sums) peak = std::max(peak, std::abs(sum));
        peak = std::max(peak, std::abs(side[(at_ + kRing - kHalf) % kRing]));
    }
    return peak;
}

void Limiter::limit(std::span<float> interleaved) noexcept {
    for (std::size_t i = 0; i < interleaved.size(); i += 2) {
        at_ = (at_ + 1) % kRing;
        came_[0][at_] = interleaved[i], came_[1][at_] = interleaved[i + 1];
        const float peak = true_peak();
        needed_[at_] = peak > kCeiling ? kCeiling / peak : 1;
        if (needed_[at_] < 1) reduced_ = static_cast<std::size_t>(20 * kReleaseS * kSampleRate);
        const std::size_t then = (at_ + kRing - kDelay) % kRing;
        float gain = 1;
        if (reduced_ > 0) {
            float least = 1;
            for (std::size_t k = 0; k < kWindow; ++k)
                least = std::min(least, needed_[(at_ + kRing - k) % kRing]);
            gain_ = std::min(least, gain_ + (1 - gain_) * kReturn);
            if (--reduced_ <= kWindow) gain_ = 1;
            returned_[at_] = gain_;
            float sum = 0;
            for (std::size_t k = 0; k < kWindow; ++k) sum += returned_[(at_ + kRing - k) % kRing];
            gain = std::min(1.0F, sum / kWindow);
        } else {
            returned_[at_] = 1;
        }
        interleaved[i] = gain * came_[0][then], interleaved[i + 1] = gain * came_[1][then];
    }
}

}  // namespace audio
