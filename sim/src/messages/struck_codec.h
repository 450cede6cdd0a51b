#pragma once
#include "bytes/byte_codec.h"
#include "messages/struck_messages.h"

namespace sim {

void write(ByteWriter& out, const StruckAssign& message);
void write(ByteWriter& out, const StruckStep& message);
void write(ByteWriter& out, const StruckAnswer& message);

[[nodiscard]] StruckAssign read_struck_assign(ByteReader& in);  ///< all readers throw DecodeError
[[nodiscard]] StruckStep read_struck_step(ByteReader& in);
[[nodiscard]] StruckAnswer read_struck_answer(ByteReader& in);

}  // namespace sim
