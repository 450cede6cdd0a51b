#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "audio/performance.h"

namespace audio {

/// Reverberation by a feedback delay network (Jot and Chaigne, Digital delay networks for designing artificial
/// reverberators, 1991): N = 8 delay lines of mutually prime lengths m_i, fed back through the Householder
/// matrix I - 2/N 1 1^T, which keeps energy. Each line's filter
///   H_i(z) = g_i (1 - b_i) / (1 - b_i z^-1),  g_i = 10^(-3 m_i / (T60 sr)),
///   b_i = ln(10) / 4 log10(g_i) (1 - 1 / alpha^2),  alpha = T60(sr / 2) / T60(0) = 1/2,
/// gives T60 at low frequencies and less at high ones. The left channel goes into the even lines, the right
/// into the odd ones; both hear all. The first echo comes after 23 ms. Its energy is to that of the dry sound
/// as level_db says, for sounds with all frequencies.
///
/// Memory is taken at construction only; a t60_s of 0 is no room and costs nothing.
class Room {
public:
    explicit Room(const RoomSound& sound);
    /// Adds the room's answer to interleaved stereo, in place.
    void add_to(std::span<float> interleaved) noexcept;
    /// Samples until it has fallen by 90 dB.
    [[nodiscard]] std::int64_t tail_samples() const { return tail_samples_; }

private:
    static constexpr std::size_t kLines = 8;
    struct Line {
        std::vector<double> samples;
        std::size_t at = 0;
        double gain = 0, pole = 0, state = 0;
    };
    std::array<Line, kLines> lines_;
    double level_ = 0;
    std::int64_t tail_samples_ = 0;
};

}  // namespace audio
