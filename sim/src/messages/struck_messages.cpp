#include "messages/struck_messages.h"

#include <array>
#include <cmath>

#include "messages/struck_codec.h"
#include "struck/request_check.h"

namespace sim {
namespace {

constexpr std::array<std::uint8_t, 4> kStruckMagic = {'M', 'W', 'S', 'M'};
constexpr std::uint16_t kVersion = 3;
constexpr std::size_t kStruckHeaderBytes = 12, kStruckChecksumBytes = 4;
constexpr std::size_t kSmallestAssignment = 400, kRecordBytes = 120;
constexpr std::uint32_t kMostBodies = 1u << 20;

constexpr std::array<std::uint32_t, 256> crc_table() {
    std::array<std::uint32_t, 256> table{};
    for (std::uint32_t i = 0; i < 256; ++i) {
        std::uint32_t c = i;
        for (int k = 0; k < 8; ++k) c = (c & 1) ? 0xEDB88320u ^ (c >> 1) : c >> 1;
        table[i] = c;
    }
    return table;
}

void write_body(ByteWriter& out, const Hello& m) {
    out.append(m.secret);
}
void write_body(ByteWriter& out, const Heartbeat& m) {
    out.append(m.secret);
}
void write_body(ByteWriter&, const Welcome&) {}
void write_body(ByteWriter&, const Stop&) {}
void write_body(ByteWriter& out, const Failure& m) {
    out.text(m.text);
}

void write_body(ByteWriter& out, const Assign& m) {
    out.number(m.epoch);
    out.count(m.bodies.size());
    for (const Assignment& a : m.bodies) {
        write(out, a.definition);
        write_record(out, a.body, m.epoch, a.record.state);
        out.number<std::uint8_t>(a.record.stepped);
        out.number(a.record.t_s);
    }
}

void write_body(ByteWriter& out, const Step& m) {
    out.number(m.epoch);
    out.number(m.step);
    out.count(m.bodies.size());
    for (const std::uint32_t body : m.bodies) out.number(body);
    write(out, m.request);
}

void write_body(ByteWriter& out, const Answer& m) {
    out.number(m.epoch);
    out.number(m.step);
    out.count(m.outcomes.size());
    for (const BodyOutcome& outcome : m.outcomes) write(out, outcome, m.epoch);
}

Assign read_assign(ByteReader& in) {
    Assign m;
    m.epoch = in.number<std::uint32_t>();
    m.bodies.resize(in.count(kSmallestAssignment));
    for (Assignment& a : m.bodies) {
        a.definition = read_definition(in);
        check_body(a.definition);
        a.record.state = read_record(in, a.body, m.epoch);
        a.record.stepped = in.flag();
        a.record.t_s = in.number<double>();
        if (a.body >= kMostBodies || !(std::abs(a.record.t_s) <= kTimeLimit_s))
            throw DecodeError("a record out of range");
    }
    return m;
}

Step read_step(ByteReader& in) {
    Step m;
    m.epoch = in.number<std::uint32_t>();
    m.step = in.number<std::uint64_t>();
    m.bodies.resize(in.count(4));
    for (std::uint32_t& body : m.bodies) body = in.number<std::uint32_t>();
    m.request = read_request(in);
    check_request(m.request, kMostBodies);
    return m;
}

Answer read_answer(ByteReader& in) {
    Answer m;
    m.epoch = in.number<std::uint32_t>();
    m.step = in.number<std::uint64_t>();
    m.outcomes.resize(in.count(kRecordBytes));
    for (BodyOutcome& outcome : m.outcomes) outcome = read_outcome(in, m.epoch);
    return m;
}

Message read_body(std::uint16_t type, ByteReader& in) {
    switch (type) {
        case 1:
            return Hello{in.bytes<16>()};
        case 2:
            return Heartbeat{in.bytes<16>()};
        case 3:
            return Welcome{};
        case 4:
            return read_assign(in);
        case 5:
            return read_step(in);
        case 6:
            return read_answer(in);
        case 7:
            return Stop{};
        case 8:
            return Failure{in.text(4096)};
        default:
            throw DecodeError("message type " + std::to_string(type) + ", expected 1 to 8");
    }
}

void struck_expect(const char* what, std::uint64_t found, std::uint64_t expected) {
    if (found == expected) return;
    throw DecodeError(std::string(what) + " " + std::to_string(found) + ", expected " +
                      std::to_string(expected));
}

}  // namespace

std::uint32_t crc32(std::span<const std::uint8_t> bytes) noexcept {
    static constexpr std::array<std::uint32_t, 256> kTable = crc_table();
    std::uint32_t c = 0xFFFFFFFFu;
    for (const std::uint8_t byte : bytes) c = kTable[(c ^ byte) & 0xFF] ^ (c >> 8);
    return ~c;
}

std::vector<std::uint8_t> encode(const Message& message) {
    ByteWriter out;
    for (const std::uint8_t letter : kStruckMagic) out.number(letter);
    out.number(kVersion);
    out.number(static_cast<std::uint16_t>(message.index() + 1));
    out.number<std::uint32_t>(0);
    std::visit([&](const auto& m) { write_body(out, m); }, message);
    const auto length = static_cast<std::uint32_t>(out.bytes().size() + kStruckChecksumBytes);
    std::memcpy(out.bytes().data() + 8, &length, sizeof length);
    out.number(crc32(out.bytes()));
    return std::move(out.bytes());
}

Message decode(std::span<const std::uint8_t> bytes) {
    if (bytes.size() < kStruckHeaderBytes + kStruckChecksumBytes)
        throw DecodeError("a message of " + std::to_string(bytes.size()) + " bytes");
    ByteReader header(bytes.first(kStruckHeaderBytes)), trailer(bytes.last(kStruckChecksumBytes));
    for (const std::uint8_t letter : kStruckMagic)
        struck_expect("first letters:", header.number<std::uint8_t>(), letter);
    struck_expect("version", header.number<std::uint16_t>(), kVersion);
    const auto type = header.number<std::uint16_t>();
    struck_expect("length", header.number<std::uint32_t>(), bytes.size());
    struck_expect("checksum", trailer.number<std::uint32_t>(),
                  crc32(bytes.first(bytes.size() - kStruckChecksumBytes)));
    ByteReader body(
        bytes.subspan(kStruckHeaderBytes, bytes.size() - kStruckHeaderBytes - kStruckChecksumBytes));
    try {
        Message message = read_body(type, body);
        body.expect_end();
        return message;
    } catch (const std::invalid_argument& e) {
        throw DecodeError(e.what());
    }
}

}  // namespace sim
