#pragma once
#include "messages/struck_messages.h"

namespace sim {

// The parts of a message's body; see struck_messages.h for the layout.

void write(ByteWriter& out, const BodyDefinition& body);
void write(ByteWriter& out, const StepRequest& request);
void write(ByteWriter& out, const BodyOutcome& outcome, std::uint32_t epoch);
void write_record(ByteWriter& out, std::uint32_t body, std::uint32_t epoch, const ModalState& state);

[[nodiscard]] BodyDefinition read_definition(ByteReader& in);  ///< all readers throw DecodeError
[[nodiscard]] StepRequest read_request(ByteReader& in);
[[nodiscard]] BodyOutcome read_outcome(ByteReader& in, std::uint32_t epoch);
[[nodiscard]] ModalState read_record(ByteReader& in, std::uint32_t& body, std::uint32_t epoch);

}  // namespace sim
