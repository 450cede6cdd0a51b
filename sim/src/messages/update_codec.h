#pragma once
#include "messages/world_messages.h"

namespace sim {

// Quantised states and pushes; see world_messages.h for layout and errors.

void write(ByteWriter& out, const std::vector<Update>& updates);
void write(ByteWriter& out, const std::vector<Push>& pushes);
[[nodiscard]] std::vector<Update> read_updates(ByteReader& in);  ///< throws DecodeError
[[nodiscard]] std::vector<Push> read_pushes(ByteReader& in);     ///< throws DecodeError

/// Where the updates and pushes are in a message's bytes; lengths are checked, the rest when they are read.
void find_updates(ByteReader& in, std::span<const std::uint8_t> all,
                  std::vector<PackedUpdates::Place>& places);
void find_pushes(ByteReader& in, std::span<const std::uint8_t> all,
                 std::vector<PackedUpdates::Place>& places);

}  // namespace sim
