#include "messages/worker_messages.h"

#include <array>

#include "bytes/archives.h"
#include "messages/world_scene_codec.h"

namespace sim {
namespace {

constexpr std::array<std::uint8_t, 4> kMagic = {'M', 'W', 'S', 'W'};
constexpr std::size_t kHeaderBytes = 28, kLengthAt = 8;

/// The variant's alternative of index `type` - 1; what is there of that type is overwritten, so that its
/// storage serves again.
template <std::size_t I = 0>
void read_message(std::size_t type, ByteReader& in, WorkerMessage& into) {
    if constexpr (I < std::variant_size_v<WorkerMessage>) {
        if (type != I + 1) return read_message<I + 1>(type, in, into);
        auto* m = std::get_if<I>(&into);
        read_fields(in, m ? *m : into.emplace<I>());
    } else {
        throw DecodeError("message type " + std::to_string(type) + ", expected 1 to " + std::to_string(I));
    }
}

void expect(const char* what, std::uint64_t found, std::uint64_t expected) {
    if (found == expected) return;
    throw DecodeError(std::string(what) + " " + std::to_string(found) + ", expected " +
                      std::to_string(expected));
}

/// Checks the length; returns the type.
std::uint16_t read_header(std::span<const std::uint8_t> bytes, MessageHeader& header) {
    if (bytes.size() < kHeaderBytes)
        throw DecodeError("a message of " + std::to_string(bytes.size()) + " bytes");
    ByteReader in(bytes.first(kHeaderBytes));
    for (const std::uint8_t letter : kMagic) expect("first letters:", in.number<std::uint8_t>(), letter);
    expect("version", in.number<std::uint16_t>(), kProtocol);
    const auto type = in.number<std::uint16_t>();
    expect("length", in.number<std::uint32_t>(), bytes.size());
    header.worker = in.number<std::uint32_t>();
    header.epoch = in.number<std::uint32_t>();
    header.step = in.number<std::uint64_t>();
    return type;
}

/// Of a message whose header has been read.
void read_message(std::uint16_t type, std::span<const std::uint8_t> bytes, WorkerMessage& into) {
    ByteReader body(bytes.subspan(kHeaderBytes));
    try {
        read_message(std::size_t{type}, body, into);
        body.expect_end();
    } catch (const std::invalid_argument& e) {
        throw DecodeError(e.what());
    }
}

}  // namespace

std::vector<std::uint8_t> encode(const MessageHeader& header, const WorkerMessage& message) {
    ByteWriter out;
    for (const std::uint8_t letter : kMagic) out.number(letter);
    out.number(kProtocol);
    out.number(static_cast<std::uint16_t>(message.index() + 1));
    out.number<std::uint32_t>(0);
    out.number(header.worker);
    out.number(header.epoch);
    out.number(header.step);
    std::visit([&](const auto& m) { write_fields(out, m); }, message);
    const auto length = static_cast<std::uint32_t>(out.bytes().size());
    std::memcpy(out.bytes().data() + kLengthAt, &length, sizeof length);
    return std::move(out.bytes());
}

DecodedMessage decode_message(std::span<const std::uint8_t> bytes) {
    DecodedMessage decoded;
    decode_message(bytes, decoded);
    return decoded;
}

void decode_message(std::span<const std::uint8_t> bytes, DecodedMessage& into) {
    const std::uint16_t type = read_header(bytes, into.header);
    read_message(type, bytes, into.message);
}

}  // namespace sim
