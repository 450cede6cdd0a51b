#pragma once
#include <array>
#include <cstddef>
#include <span>

namespace audio {

/// What a mode is, in the order of its table's columns.
struct ModeParameters {
    double frequency_hz = 0;
    double t60_s = 0;   ///< time in which it falls by 60 dB
    double weight = 0;  ///< amplitude after a unit impulse of the force
    double drive = 0;   ///< and of the drive
};

/// Damped modes of a sounding body, each of which answers two inputs, the force F of the contact and a drive D
/// (what other modes do to it), by the state z = x + i y:
///   z[n] = r e^(i theta) (z[n-1] + weight F[n] + drive D[n]),  theta = 2 pi f / sr,  r = 0.001^(1 / (t60 sr)),
/// exact in pitch and decay (Mathews and Smith, Methods for Synthesizing Very High Q Parametrically Well
/// Behaved Two Pole Filters, 2003); what is heard is y. Single precision suffices: a rotation's coefficients
/// keep their relative precision at low frequencies, where those of a biquad do not.
///
/// Where nothing comes in, samples n + 1 to n + 4 are Im(p z), ..., Im(p^4 z) of the same z[n], p = r e^(i theta):
/// two products each, of which none waits for another, and one rotation by p^4; so are the four samples behind, of the
/// turned z. Many notes together do not fit into the processor's cache: a mode keeps no more than p and p^4.
///
/// A trivial type without alignment of its own, which lies in memory that Csound clears and gives out again.
/// Sixteen modes go together; once they are quiet they rest for good. No allocation.
class ModalBank {
public:
    static constexpr std::size_t kMostModes = 512, kMostSamples = 64;
    static constexpr std::size_t kLanes = 8, kTogether = 2 * kLanes;  ///< modes in a vector, in a group
    static constexpr std::size_t kAhead = 4;                          ///< powers of p that are used

    /// A new start from rest with at most kMostModes; others are left out, as are modes from 20 kHz on.
    /// `rest_below`: amplitude from which a group rests while nothing comes in.
    void set(std::span<const ModeParameters> modes, double sample_rate, double rest_below) noexcept;
    /// Multiplies all frequencies by `bend` and all decay times by `ring`, from the next sample on; the states go on.
    void tune(double bend, double ring) noexcept;
    /// At most kMostSamples. mid: the sum of all modes; side: the same with every second pair of modes
    /// inverted, which stands for the body's directions of radiation.
    void render(std::span<const float> force, std::span<const float> drive, std::span<float> mid,
                std::span<float> side) noexcept;

private:
    using Column = std::array<float, kMostModes>;
    struct Inputs;
    void drive_group(std::size_t first, std::size_t begin, const Inputs& inputs, float* sums) noexcept;
    void ring_group(std::size_t first, std::size_t samples, float* sums) noexcept;
    [[nodiscard]] float largest_square(std::size_t first) const noexcept;
    void rotate(std::size_t mode) noexcept;

    Column real_, imaginary_;  ///< z
    /// Of each group the real and imaginary parts of p, then of p^4: kTogether of each.
    std::array<float, kMostModes * 4> powers_;
    Column weight_, drive_;  ///< gains of the inputs
    Column angle_, radius_;  ///< theta, r; untuned
    std::array<bool, kMostModes / kTogether> sounds_;
    std::size_t groups_;
    float rest_below_, bend_, ring_;
};

}  // namespace audio
