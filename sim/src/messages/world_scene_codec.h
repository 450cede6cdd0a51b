#pragma once
#include "messages/worker_messages.h"

namespace sim {

// What a worker is given when it joins. Reading throws DecodeError or std::invalid_argument.

void write(ByteWriter& out, const WorldScene& scene);
void write(ByteWriter& out, const DistributedSettings& settings);
[[nodiscard]] WorldScene read_scene(ByteReader& in);
[[nodiscard]] DistributedSettings read_settings(ByteReader& in);

/// Throws std::invalid_argument: what was found, what was expected.
void check_scene(const WorldScene& scene);
void check_settings(const DistributedSettings& settings);

}  // namespace sim
