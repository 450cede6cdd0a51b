#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "bytes/byte_codec.h"
#include "messages/secret.h"
#include "struck/stepped_body.h"

namespace sim {

// Messages between the application and its workers. One ZeroMQ frame each, little-endian, no padding.
//
//   offset  bytes
//   0       4      "MWSM"
//   4       2      version, 3
//   6       2      type
//   8       4      length of the whole message
//   12      ...    body, by type
//   end-4   4      CRC-32 (IEEE 802.3, reflected) of everything before
//
// f64 are IEEE doubles bit by bit, v3 = 3 f64, flag = u8 of 0 or 1, text = u32 length and bytes, list = u32
// count and the elements.
//
//   1 hello      worker  16 bytes: its secret
//   2 heartbeat  worker  16 bytes: its secret
//   3 welcome    app     nothing; answers a hello
//   4 assign     app     u32 epoch, list of {definition, record, u8 stepped, f64 t_s}
//   5 step       app     u32 epoch, u64 step, list of u32 body, request
//   6 answer     worker  u32 epoch, u64 step, list of {record, lists of picture, f64 clearance, contact}
//   7 stop       app     nothing
//   8 failure    worker  text
//
//   record           120 bytes: u32 body, u32 epoch, f64 q[6], f64 q_dot[6], f64 swing, f64 swing_dot
//   picture          112 bytes: a record's doubles
//   definition       text name, f64 a b c e1 e2, f64 young poisson density,
//                    flag visual, f64 frequency displacement decay, flag hinged, v3 pivot, v3 axis,
//                    f64 frequency damping, f64 rotation[9] by columns, v3 translation, f64 mass restitution,
//                    list of zone {text name, f64 min radius, max radius, min height, max height}
//   request          f64 t_s, flag anew, lists of impulse (folded), impulse (confirmed), path, wanted
//   impulse          60 bytes: u32 body, f64 t_s, v3 point, v3 impulse
//   path             u32 stick, f64 tip radius, list of node {f64 t_s, v3 position, v3 velocity}
//   wanted           f64 t_s, list of {impulse, f64 weight}; states for a picture
//   contact          133 bytes: u32 path, u32 stick, f64 t_s, flag starts inside, f64 depth, f64 speed,
//                    i32 zone, v3 point_world, v3 normal_world, v3 point_body, v3 impulse_body
//
// Decoders check length, checksum, counts, flags, text lengths, that every number is finite and in the range
// check_body and check_request state, and that nothing is left over; else they throw DecodeError.

struct Hello {
    Secret secret = {};
};
struct Heartbeat {
    Secret secret = {};
};
struct Welcome {};
struct Assignment {
    std::uint32_t body;
    BodyDefinition definition;
    BodyRecord record;
};
struct Assign {
    std::uint32_t epoch = 0;
    std::vector<Assignment> bodies;
};
struct Step {
    std::uint32_t epoch = 0;
    std::uint64_t step = 0;
    std::vector<std::uint32_t> bodies;
    StepRequest request;
};
struct Answer {
    std::uint32_t epoch = 0;
    std::uint64_t step = 0;
    std::vector<BodyOutcome> outcomes;
};
struct Stop {};
struct Failure {
    std::string text;
};

using Message = std::variant<Hello, Heartbeat, Welcome, Assign, Step, Answer, Stop, Failure>;

[[nodiscard]] std::vector<std::uint8_t> encode(const Message& message);  ///< one frame, checksum included
[[nodiscard]] Message decode(std::span<const std::uint8_t> bytes);       ///< throws DecodeError

[[nodiscard]] std::uint32_t crc32(std::span<const std::uint8_t> bytes) noexcept;  ///< IEEE 802.3

}  // namespace sim
