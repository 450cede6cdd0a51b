#pragma once
#include "bytes/byte_codec.h"
#include "world/body_path.h"
#include "world/manifold.h"

namespace sim {

// What partners tell each other of a step (partners.h): numbers as they lie in memory. Readers throw DecodeError for bytes that
// are missing, for places outside of what is there, and for numbers that are not finite: such a step is done alone.

void write(ByteWriter& out, const Manifold& manifold);  ///< of planes, all points
/// Checks all of it, and leaves its points in the message, which must stay where it is for as long as they are there.
/// `bodies`, `planes`: of the world, which bounds what it may name.
void read(ByteReader& in, Manifold& manifold, const std::vector<MovingBody>& bodies, std::size_t planes);
/// Passes one over; its key.
[[nodiscard]] std::uint64_t skip_manifold(ByteReader& in);

void write_impulses(ByteWriter& out, const Manifold& manifold);
/// As read: in the message, if the points are in theirs.
void read_impulses(ByteReader& in, Manifold& manifold);
/// Takes points and impulses out of the messages.
void unpack_points(Manifold& manifold);
inline void unpack(Manifold& manifold) {
    if (manifold.packed_points) unpack_points(manifold);
}

/// State, and whether its deformation was held.
void write(ByteWriter& out, const MovingBody& body);
void read(ByteReader& in, MovingBody& body);

void write(ByteWriter& out, const BodyPath& path);
void read(ByteReader& in, BodyPath& path, double dt);  ///< over a step of dt [s]

void write_floats(ByteWriter& out, std::span<const float> floats);
void read_floats(ByteReader& in, std::span<float> floats);
[[nodiscard]] double read_finite(ByteReader& in);

}  // namespace sim
