#pragma once
#include <bit>
#include <cmath>

#include "messages/worker_messages.h"

namespace sim {

// Quantised states and the impulses between workers; see worker_messages.h for layout and errors.

void write(ByteWriter& out, const std::vector<Update>& updates);
void write(ByteWriter& out, const std::vector<CrossImpulse>& crossed);
/// Into the storage that is there. Throws DecodeError.
void read_updates(ByteReader& in, std::vector<Update>& updates);
[[nodiscard]] std::vector<CrossImpulse> read_crossed(ByteReader& in);  ///< throws DecodeError

/// The same number with a float's precision, towards zero, as it arrives elsewhere. By its bits: GCC 12 leaves out a conversion to
/// float and back where it vectorises.
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
