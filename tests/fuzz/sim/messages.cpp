// Messages between an application and its workers, as each reads them. Version and length are made right, so that
// what lies behind them is reached.
#include <cstring>
#include <variant>
#include <vector>

#include "fuzz_target.h"
#include "messages/worker_messages.h"

namespace {

void seal(std::vector<std::uint8_t>& bytes) {
    if (bytes.size() < 28) return;
    std::memcpy(bytes.data() + 4, &sim::kProtocol, sizeof sim::kProtocol);
    const auto length = static_cast<std::uint32_t>(bytes.size());
    std::memcpy(bytes.data() + 8, &length, sizeof length);
}

}  // namespace

void fuzz_messages(std::string_view text) {
    std::vector<std::uint8_t> bytes(text.begin(), text.end());
    seal(bytes);
    try {
        const sim::DecodedMessage m = sim::decode_message(bytes);
        const std::vector<std::uint8_t> written = sim::encode(m.header, m.message);
        require(sim::encode(m.header, sim::decode_message(written).message) == written,
                "a message that reads back to another");
    } catch (const sim::DecodeError&) {
    }
}
