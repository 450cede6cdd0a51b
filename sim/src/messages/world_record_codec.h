#pragma once
#include "messages/worker_messages.h"

namespace sim {

// Records of bodies, exact; see worker_messages.h for the layout.

constexpr std::uint32_t kMostWorldBodies = 1u << 24;

/// A body's number and its count of modes in four bytes. Throws std::invalid_argument beyond 2^24 or 128.
[[nodiscard]] std::uint32_t body_and_modes(std::uint32_t body, Eigen::Index modes);
struct BodyAndModes {
    std::uint32_t body;
    int modes;
};
[[nodiscard]] BodyAndModes read_body_and_modes(ByteReader& in);  ///< throws DecodeError

/// Whether a state is not finite or out of the range in which World keeps a body.
[[nodiscard]] bool is_broken(const WorldBodyState& state);

void write(ByteWriter& out, const std::vector<WorldRecord>& records);
[[nodiscard]] std::vector<WorldRecord> read_world_records(ByteReader& in);  ///< throws DecodeError

}  // namespace sim
