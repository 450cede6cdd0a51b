#pragma once
#include "bytes/byte_codec.h"
#include "world/body_path.h"
#include "world/manifold.h"

namespace sim {

// What partners tell each other of a step (partners.h): numbers as they lie in memory. Readers throw DecodeError for bytes that
// are missing, and for places outside of what is there; numbers themselves are taken as they are.

void write(ByteWriter& out, const Manifold& manifold);  ///< of planes, all points
/// `bodies`, `planes`: of the world, which bounds what it may name.
void read(ByteReader& in, Manifold& manifold, const std::vector<MovingBody>& bodies, std::size_t planes);

void write_impulses(ByteWriter& out, const Manifold& manifold);
void read_impulses(ByteReader& in, Manifold& manifold);

/// State, and whether its deformation was held.
void write(ByteWriter& out, const MovingBody& body);
void read(ByteReader& in, MovingBody& body);

void write(ByteWriter& out, const BodyPath& path);
void read(ByteReader& in, BodyPath& path);

inline void write_floats(ByteWriter& out, std::span<const float> floats) {
    out.append({reinterpret_cast<const std::uint8_t*>(floats.data()), floats.size_bytes()});
}
inline void read_floats(ByteReader& in, std::span<float> floats) {
    std::memcpy(floats.data(), in.take(floats.size_bytes()).data(), floats.size_bytes());
}

}  // namespace sim
