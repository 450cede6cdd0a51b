// Messages between a play and its workers. Length and checksum are made right, so that what lies behind them is reached.
#include <cstring>
#include <vector>

#include "fuzz_target.h"
#include "messages/struck_messages.h"

void fuzz(std::string_view text) {
    std::vector<std::uint8_t> bytes(text.begin(), text.end());
    if (bytes.size() >= 16) {
        const auto length = static_cast<std::uint32_t>(bytes.size());
        std::memcpy(bytes.data() + 8, &length, sizeof length);
        const std::uint32_t sum = sim::crc32(std::span(bytes).first(bytes.size() - 4));
        std::memcpy(bytes.data() + bytes.size() - 4, &sum, sizeof sum);
    }
    try {
        require(sim::encode(sim::decode(bytes)) == bytes, "a message that is written otherwise");
    } catch (const sim::DecodeError&) {
    }
}
