#pragma once
#include <bit>
#include <cmath>
#include <span>
#include <vector>

#include "bytes/byte_codec.h"
#include "world/shared_world.h"

namespace sim {

// Rounded states, and the impulses between workers, in few bytes. Little-endian; f32, f16 are IEEE numbers,
// v3 = 3 f64, w3 = 3 f32; b/m = u32: body below 2^24, and number of modes (at most 128) times 2^24.
//
//   Update        37 + 3 m bytes, 73 with 12 modes, 36 with none; if held, 13 + m more, 98 in all:
//                 b/m, u8 (1 asleep, 2 still, 4 quarantined, 8 held, and 16 times E), w3 position,
//                 7 bytes orientation, 3 f16 velocity, 3 i16 angular momentum in units of
//                 2^(4 E - 44) kg m^2/s, f16 q[m], small q'[m];
//                 held: 3 f16 linear, 3 f16 angular, small modal[m]
//   small         of n numbers, if there are any: i8 E, n i8 in units of 2^E, E the least with
//                 which none is beyond 127
//   CrossImpulse  33 bytes: u32 own (+ 2^31: rebound), u32 ghost, u8 E of the first and
//                 16 times E of the second, w3 linear on own, 3 i16 angular on own,
//                 3 i16 angular on ghost, in units of 2^(4 E - 44) kg m^2/s
//
// The 7 bytes of an orientation: 56 bits, lowest first: which of x, y, z, w is largest in size (2 bits; it is
// made positive and follows from the others), the other three in that order, each 18 bits, 0 to 2^18 - 1 for
// -1/sqrt 2 to 1/sqrt 2.
//
// Largest errors of an update: position 2^-24 of each coordinate; orientation 1.9e-5 rad;
// angular momentum 1/4095 of its largest coordinate (plus 2^-45 kg m^2/s; range 2.1e9); f16 2^-11 of each
// number (plus 3e-8; range 65504); small 1/127 of the largest (plus 2^-129).
//
// Of a broken state (see is_broken) the numbers do not travel: zeros stand for them (and w = 1 for the
// orientation), and the angular momentum is -32768 three times; the decoder sets the position to NaN.

/// One body's state: rounded as it travels.
struct Update {
    std::uint32_t body = 0;
    bool asleep = false, still = false, quarantined = false;
    WorldBodyState state;
    bool held = false;    ///< whether `impulse` is there
    StepImpulse impulse;  ///< from the owner's other bodies, the mean of a step; linear, angular, modal
};
/// Updates as bytes: of those that one worker sends another few are needed soon, and those are read then.
class PackedUpdates {
public:
    struct Place {
        std::uint32_t body, offset;
        Eigen::Index modes;
        bool asleep, quarantined;
        Eigen::Vector3d position, velocity;  ///< [m], [m/s]
    };
    [[nodiscard]] const std::vector<Place>& places() const noexcept { return places_; }
    [[nodiscard]] std::span<const std::uint8_t> bytes() const noexcept { return bytes_; }
    void clear() { bytes_.clear(), places_.clear(); }
    void add(const Update& update);
    /// One of other packed updates.
    void add(const PackedUpdates& from, const Place& place);
    /// Those that follow there; each is read once. Throws DecodeError.
    void read(ByteReader& in);
    void read(const Place& place, Update& into) const;

private:
    std::vector<std::uint8_t> bytes_;
    std::vector<Place> places_;
};

void write(ByteWriter& out, const std::vector<Update>& updates);
void write(ByteWriter& out, const PackedUpdates& updates);
void write(ByteWriter& out, const std::vector<CrossImpulse>& crossed);
/// Into the storage that is there. Throw DecodeError.
void read(ByteReader& in, std::vector<Update>& updates);
void read(ByteReader& in, PackedUpdates& updates);
void read(ByteReader& in, std::vector<CrossImpulse>& crossed);

/// The same number with a float's precision, towards zero, as it arrives elsewhere. By its bits: GCC 12
/// leaves out a conversion to float and back where it vectorises.
[[nodiscard]] inline Eigen::Vector3d as_sent(const Eigen::Vector3d& v) {
    constexpr std::uint64_t kBeyondFloat = (std::uint64_t{1} << 29) - 1;
    constexpr double kLeast = 1e-30, kMost = 1e30;  // well within a float's range
    const auto of = [](double x) {
        const double size = std::abs(x);
        if (!(size > kLeast)) return 0.0;
        if (size > kMost) x = std::copysign(kMost, x);
        return std::bit_cast<double>(std::bit_cast<std::uint64_t>(x) & ~kBeyondFloat);
    };
    return {of(v.x()), of(v.y()), of(v.z())};
}

/// Of an angular impulse.
[[nodiscard]] Eigen::Vector3d angular_as_sent(const Eigen::Vector3d& v);

}  // namespace sim
