#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "audio/performance.h"
#include "convolution.h"

namespace audio {

/// Reverberation by a feedback delay network (Jot and Chaigne, Digital delay networks for designing artificial
/// reverberators, 1991): N = 8 delay lines of mutually prime lengths m_i, fed back through the Householder
/// matrix I - 2/N 1 1^T, which keeps energy. Each line's filter
///   H_i(z) = g_i (1 - b_i) / (1 - b_i z^-1),  g_i = 10^(-3 m_i / (T60 sr)),
///   b_i = ln(10) / 4 log10(g_i) (1 - 1 / alpha^2),  alpha = T60(sr / 2) / T60(0) = 1/2,
/// gives T60 at low frequencies and less at high ones. The left channel goes into the even lines, the right
/// into the odd ones; both hear all. The first echo comes after 23 ms. Its energy is to that of the dry sound
/// as level_db says, for sounds with all frequencies. With an impulse response the room is its convolution instead.
///
/// Memory is taken at construction only; a t60_s of 0 is no room and costs nothing.
class Room {
public:
    /// `block`: frames of each call, where there is an impulse response (a power of two up to 2048).
    explicit Room(const RoomSound& sound, std::size_t block = 64);
    /// Adds the room's answer to `input` to `output`, interleaved stereo; both may be the same.
    void add_answer(std::span<const float> input, std::span<float> output) noexcept;
    /// Samples until it has fallen by 90 dB.
    [[nodiscard]] std::int64_t tail_samples() const { return tail_samples_; }

private:
    static constexpr std::size_t kLines = 8;
    struct Line {
        std::vector<double> samples;
        std::size_t at = 0;
        double gain = 0, pole = 0, state = 0;
    };
    std::unique_ptr<Convolution> convolution_;
    std::array<Line, kLines> lines_;
    double level_ = 0;
    std::int64_t tail_samples_ = 0;
};

}  // namespace audio
