#include "messages/worker_messages.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "messages/struck_codec.h"
#include "messages/update_codec.h"
#include "messages/world_record_codec.h"
#include "messages/world_scene_codec.h"

namespace sim {
namespace {

constexpr std::array<std::uint8_t, 4> kMagic = {'M', 'W', 'S', 'W'};
constexpr std::size_t kHeaderBytes = 28, kLengthAt = 8, kFoundBytes = 12, kPlaceBytes = 16;
constexpr std::size_t kMishapBytes = 17;  // at least
constexpr std::uint8_t kHasBodies = 1, kHasCrossed = 2, kHasBroken = 4, kHasPlaces = 8;
constexpr std::uint32_t kLongestText = 4096, kLongestReason = 64, kLongestHost = 255;

// What several messages hold.

void write(ByteWriter& out, const StepReport& r) {
    for (const float x : {r.seconds, r.smoothed_s, r.waited_s, r.processor_s}) out.number(x);
    for (const std::uint32_t n : {r.lead, r.ghost_age, r.cross_contacts, r.own}) out.number(n);
    out.matrix(r.outside_impulse);
    out.count(r.mishaps.size());
    for (const Mishap& m : r.mishaps) {
        out.number(static_cast<std::uint8_t>(m.kind));
        out.number(m.number);
        out.number(m.step);
        out.text(m.what.substr(0, kLongestReason));
    }
}

/// What a peer says of itself goes into reports and onto terminals: printable ASCII, a question mark for any
/// other byte.
std::string read_words(ByteReader& in, std::uint32_t longest) {
    std::string text = in.text(longest);
    for (char& c : text)
        if (c < ' ' || c > '~') c = '?';
    return text;
}

Mishap read_mishap(ByteReader& in) {
    const auto kind = in.number<std::uint8_t>();
    if (kind > static_cast<std::uint8_t>(Mishap::Kind::broken))
        throw DecodeError("a mishap of kind " + std::to_string(kind) + ", expected at most 2");
    Mishap m{static_cast<Mishap::Kind>(kind), in.number<std::uint32_t>(), in.number<std::uint64_t>(), {}};
    m.what = read_words(in, kLongestReason);
    return m;
}

StepReport read_report(ByteReader& in) {
    StepReport r;
    for (float* x : {&r.seconds, &r.smoothed_s, &r.waited_s, &r.processor_s}) {
        *x = in.number<float>();
        if (!(*x >= 0 && *x <= 1e9f)) throw DecodeError("a report of a time out of range");
    }
    for (std::uint32_t* n : {&r.lead, &r.ghost_age, &r.cross_contacts, &r.own})
        *n = in.number<std::uint32_t>();
    in.matrix(r.outside_impulse);
    if (!r.outside_impulse.allFinite()) throw DecodeError("a report that is not finite");
    r.mishaps.resize(in.count(kMishapBytes));
    for (Mishap& m : r.mishaps) m = read_mishap(in);
    return r;
}

void write_found(ByteWriter& out, const std::vector<FoundStep>& found) {
    out.count(found.size());
    for (const FoundStep& step : found) out.number(step.step), write(out, step.crossed);
}

void read_found(ByteReader& in, std::vector<FoundStep>& found) {
    found.resize(in.count(kFoundBytes));
    for (FoundStep& step : found) step.step = in.number<std::uint64_t>(), step.crossed = read_crossed(in);
}

void write(ByteWriter& out, const Eigen::Vector3f& v) {
    for (const float x : v) out.number(x);
}

Eigen::Vector3f read_place(ByteReader& in) {
    Eigen::Vector3f v;
    for (float& x : v) x = in.number<float>();
    if (!v.allFinite()) throw DecodeError("a place that is not finite");
    return v;
}

std::string shortened(const std::string& text) {
    return text.substr(0, kLongestText);
}

// Bodies of messages, in order of types.

void write_body(ByteWriter& out, const JoinRequest& m) {
    out.append(m.secret);
    out.text(m.host.substr(0, kLongestHost));
}
void write_body(ByteWriter& out, const Beat& m) {
    out.append(m.secret);
}
void write_body(ByteWriter&, const Drained&) {}
void write_body(ByteWriter&, const Leaves&) {}
void write_body(ByteWriter& out, const WorkerFailure& m) {
    out.text(shortened(m.what));
}
void write_body(ByteWriter& out, const SceneMessage& m) {
    out.number(m.worker);
    write(out, m.scene);
    write(out, m.settings);
}
void write_body(ByteWriter& out, const Refusal& m) {
    out.text(shortened(m.why));
}
void write_body(ByteWriter&, const EndOfRun&) {}
void write_numbers(ByteWriter& out, const std::vector<std::uint32_t>& numbers) {
    out.count(numbers.size());
    for (const std::uint32_t number : numbers) out.number(number);
}
void read_numbers(ByteReader& in, std::vector<std::uint32_t>& numbers) {
    numbers.resize(in.count(4));
    for (std::uint32_t& number : numbers) number = in.number<std::uint32_t>();
}
void write_body(ByteWriter& out, const Members& m) {
    write_numbers(out, m.workers);
    out.number<std::uint8_t>(m.owners_follow);
}
void write_body(ByteWriter& out, const Ownership& m) {
    out.number(m.owner);
    out.number(m.from);
    out.number<std::uint8_t>(m.traded);
    out.number(m.step);
    write(out, m.bodies);
    write(out, m.around);
    out.count(m.around_step.size());
    for (const std::uint64_t step : m.around_step) out.number(step);
}
void write_body(ByteWriter& out, const PastMessage& m) {
    write_numbers(out, m.broken);
    out.count(m.sales.size());
    for (const auto& [body, before, step] : m.sales) out.number(body), out.number(before), out.number(step);
}
void write_body(ByteWriter& out, const StateMessage& m) {
    write(out, m.report);
    write(out, m.bodies);
}
void write_body(ByteWriter& out, const UpdateMessage& m) {
    write(out, m.report);
    write(out, m.bodies);
    write_numbers(out, m.broken);
}
void write_body(ByteWriter& out, const StruckAssign& m) {
    write(out, m);
}
void write_body(ByteWriter& out, const StruckStep& m) {
    write(out, m);
}
void write_body(ByteWriter& out, const StruckAnswer& m) {
    write(out, m);
}
void write_body(ByteWriter& out, const Offer& m) {
    if (m.bodies.size() != m.cost_s.size()) throw std::invalid_argument("an offer without all costs");
    out.number(m.to);
    out.number(m.number);
    out.number<std::uint8_t>(m.gathers);
    out.count(m.bodies.size());
    for (std::size_t i = 0; i < m.bodies.size(); ++i) {
        out.number(m.bodies[i]);
        out.number(m.cost_s[i]);
    }
}
void write_body(ByteWriter& out, const OfferAnswer& m) {
    out.number(m.to);
    out.number(m.number);
    out.number<std::uint8_t>(m.accepted);
}
void write_body(ByteWriter& out, const Handover& m) {
    out.number(m.to);
    out.number(m.number);
    write(out, m.bodies);
}

void write_body(ByteWriter& out, const Gather& m) {
    out.number(m.to);
    write_numbers(out, m.bodies);
}
void write_body(ByteWriter& out, const NeighbourMessage& m) {
    const std::uint8_t has = (m.bodies.places().empty() ? 0 : kHasBodies) |
                             (m.crossed.empty() ? 0 : kHasCrossed) | (m.broken.empty() ? 0 : kHasBroken) |
                             (m.places.empty() ? 0 : kHasPlaces);
    out.number(has);
    out.number(m.to);
    out.number(m.heard);
    out.number(m.smoothed_s);
    out.number(m.own);
    // Of none: low beyond high.
    write(out, m.reach.box.isEmpty() ? Eigen::Vector3f::Ones() : m.reach.box.min());
    write(out, m.reach.box.isEmpty() ? Eigen::Vector3f::Zero() : m.reach.box.max());
    out.number(m.reach.parts);
    out.number(m.reach.speed);
    if (has & kHasBodies) {
        out.count(m.bodies.places().size());
        out.append(m.bodies.bytes());
    }
    if (has & kHasCrossed) write(out, m.crossed);
    if (has & kHasBroken) write_numbers(out, m.broken);
    if (!(has & kHasPlaces)) return;
    out.count(m.places.size());
    for (const NeighbourMessage::Place& place : m.places) {
        out.number(place.body);
        write(out, place.position);
    }
}
void write_body(ByteWriter& out, const FoundMessage& m) {
    out.number(m.to);
    out.number(m.epoch);
    write_found(out, m.steps);
}

void read_body(ByteReader& in, JoinRequest& m) {
    m.secret = in.bytes<16>();
    m.host = read_words(in, kLongestHost);
}
void read_body(ByteReader& in, Beat& m) {
    m.secret = in.bytes<16>();
}
void read_body(ByteReader&, Drained&) {}
void read_body(ByteReader&, Leaves&) {}
void read_body(ByteReader& in, WorkerFailure& m) {
    m.what = read_words(in, kLongestText);
}
void read_body(ByteReader& in, SceneMessage& m) {
    m.worker = in.number<std::uint32_t>();
    m.scene = read_scene(in);
    m.settings = read_settings(in);
}
void read_body(ByteReader& in, Refusal& m) {
    m.why = read_words(in, kLongestText);
}
void read_body(ByteReader&, EndOfRun&) {}
void read_body(ByteReader& in, Members& m) {
    read_numbers(in, m.workers);
    m.owners_follow = in.flag();
}
void read_body(ByteReader& in, Ownership& m) {
    m.owner = in.number<std::uint32_t>();
    m.from = in.number<std::uint32_t>();
    m.traded = in.flag();
    m.step = in.number<std::uint64_t>();
    m.bodies = read_world_records(in);
    m.around = read_world_records(in);
    m.around_step.resize(in.count(8));
    for (std::uint64_t& step : m.around_step) step = in.number<std::uint64_t>();
    if (m.around_step.size() != m.around.size()) throw DecodeError("found states without their steps");
}
void read_body(ByteReader& in, PastMessage& m) {
    read_numbers(in, m.broken);
    m.sales.resize(in.count(16));
    for (auto& [body, before, step] : m.sales) {
        body = in.number<std::uint32_t>(), before = in.number<std::uint32_t>();
        step = in.number<std::uint64_t>();
    }
}
void read_body(ByteReader& in, StateMessage& m) {
    m.report = read_report(in);
    m.bodies = read_world_records(in);
}
void read_body(ByteReader& in, UpdateMessage& m) {
    m.report = read_report(in);
    read_updates(in, m.bodies);
    read_numbers(in, m.broken);
}
void read_body(ByteReader& in, Gather& m) {
    m.to = in.number<std::uint32_t>();
    read_numbers(in, m.bodies);
}
void read_body(ByteReader& in, NeighbourMessage& m) {
    const auto has = in.number<std::uint8_t>();
    if (has >= 2 * kHasPlaces) throw DecodeError("lists of no known kind");
    m.to = in.number<std::uint32_t>();
    m.heard = in.number<std::uint64_t>();
    m.smoothed_s = in.number<float>();
    if (!(m.smoothed_s >= 0 && m.smoothed_s <= 1e9f)) throw DecodeError("a report of a time out of range");
    m.own = in.number<std::uint32_t>();
    const Eigen::Vector3f low = read_place(in), high = read_place(in);
    if (std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff()) > static_cast<float>(kFurthestReach))
        throw DecodeError("a reach out of range");
    m.reach.box = {low, high};
    m.reach.parts = in.number<std::uint64_t>();
    m.reach.speed = in.number<float>();
    if (!(m.reach.speed >= 0 && m.reach.speed <= 1e9f)) throw DecodeError("a speed out of range");
    m.bodies.clear(), m.crossed.clear(), m.broken.clear(), m.places.clear();
    if (has & kHasBodies) m.bodies.read(in);
    if (has & kHasCrossed) m.crossed = read_crossed(in);
    if (has & kHasBroken) read_numbers(in, m.broken);
    if (has & kHasPlaces) m.places.resize(in.count(kPlaceBytes));
    for (NeighbourMessage::Place& place : m.places) {
        place.body = in.number<std::uint32_t>();
        place.position = read_place(in);
    }
    const auto empty = [](const auto& list) { return list.empty(); };
    if ((has & kHasBodies && empty(m.bodies.places())) || (has & kHasCrossed && empty(m.crossed)) ||
        (has & kHasBroken && empty(m.broken)) || (has & kHasPlaces && empty(m.places)))
        throw DecodeError("a list of nothing");
}
void read_body(ByteReader& in, FoundMessage& m) {
    m.to = in.number<std::uint32_t>();
    m.epoch = in.number<std::uint32_t>();
    read_found(in, m.steps);
}
void read_body(ByteReader& in, StruckAssign& m) {
    m = read_struck_assign(in);
}
void read_body(ByteReader& in, StruckStep& m) {
    m = read_struck_step(in);
}
void read_body(ByteReader& in, StruckAnswer& m) {
    m = read_struck_answer(in);
}
void read_body(ByteReader& in, Offer& m) {
    m.to = in.number<std::uint32_t>();
    m.number = in.number<std::uint32_t>();
    m.gathers = in.flag();
    m.bodies.resize(in.count(8));
    m.cost_s.resize(m.bodies.size());
    for (std::size_t i = 0; i < m.bodies.size(); ++i) {
        m.bodies[i] = in.number<std::uint32_t>();
        m.cost_s[i] = in.number<float>();
        if (m.bodies[i] >= kMostWorldBodies || !(m.cost_s[i] >= 0 && m.cost_s[i] <= 1e9f))
            throw DecodeError("an offer out of range");
    }
}
void read_body(ByteReader& in, OfferAnswer& m) {
    m.to = in.number<std::uint32_t>();
    m.number = in.number<std::uint32_t>();
    m.accepted = in.flag();
}
void read_body(ByteReader& in, Handover& m) {
    m.to = in.number<std::uint32_t>();
    m.number = in.number<std::uint32_t>();
    m.bodies = read_world_records(in);
}

/// The variant's alternative of index `type` - 1; what is there of that type is overwritten, so that its storage serves again.
template <std::size_t I = 0>
void read_message(std::size_t type, ByteReader& in, WorkerMessage& into) {
    if constexpr (I < std::variant_size_v<WorkerMessage>) {
        if (type != I + 1) return read_message<I + 1>(type, in, into);
        auto* m = std::get_if<I>(&into);
        read_body(in, m ? *m : into.emplace<I>());
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
    std::visit([&](const auto& m) { write_body(out, m); }, message);
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
