#pragma once
#include "world_messages.h"

namespace sim {

// Quantised states and pushes; see world_messages.h for layout and errors.

void write(ByteWriter& out, const std::vector<Update>& updates);
void write(ByteWriter& out, const std::vector<Push>& pushes);
[[nodiscard]] std::vector<Update> read_updates(ByteReader& in);
[[nodiscard]] std::vector<Push> read_pushes(ByteReader& in);

}  // namespace sim
