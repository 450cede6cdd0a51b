#include "messages/world_record_codec.h"

#include <cmath>
#include <limits>

#include "body/body_kind.h"

namespace sim {
namespace {

constexpr std::uint8_t kAsleep = 1, kQuarantined = 2, kAtLimit = 4, kBroken = 8;
constexpr std::size_t kSmallestRecord = 115;
constexpr double kFurthest = 1e7, kFastest = 1e6;  // m, m/s: as World quarantines

void write_doubles(ByteWriter& out, const Eigen::VectorXd& v, bool zeros) {
    for (const double x : v) out.number(zeros ? 0.0 : x);
}

Eigen::VectorXd read_doubles(ByteReader& in, int n) {
    Eigen::VectorXd v(n);
    in.matrix(v);
    return v;
}

void write(ByteWriter& out, const WorldBodyState& s, bool broken) {
    const Eigen::Vector3d none = Eigen::Vector3d::Zero();
    const Eigen::Quaterniond o = broken ? Eigen::Quaterniond::Identity() : s.orientation;
    out.matrix(broken ? none : s.position);
    for (const double x : {o.w(), o.x(), o.y(), o.z()}) out.number(x);
    out.matrix(broken ? none : s.velocity);
    out.matrix(broken ? none : s.angular_momentum);
    write_doubles(out, s.q, broken);
    write_doubles(out, s.q_dot, broken);
}

WorldBodyState read_state(ByteReader& in, int modes, bool broken) {
    WorldBodyState s;
    in.matrix(s.position);
    s.orientation.w() = in.number<double>();
    Eigen::Vector3d xyz;
    in.matrix(xyz);
    s.orientation.vec() = xyz;
    in.matrix(s.velocity);
    in.matrix(s.angular_momentum);
    s.q = read_doubles(in, modes);
    s.q_dot = read_doubles(in, modes);
    if (is_broken(s)) throw DecodeError("a state that is not finite or out of range");
    if (broken) s.position.setConstant(std::numeric_limits<double>::quiet_NaN());
    return s;
}

void write(ByteWriter& out, const WorldRecord& r) {
    const bool broken = is_broken(r.state);
    out.number(body_and_modes(static_cast<std::uint32_t>(r.body), r.state.q.size()));
    out.number(static_cast<std::uint8_t>((r.asleep ? kAsleep : 0) | (r.quarantined ? kQuarantined : 0) |
                                         (r.at_limit ? kAtLimit : 0) | (broken ? kBroken : 0)));
    out.number(r.still_steps);
    out.number(r.sleep_group);
    write(out, r.state, broken);
}

WorldRecord read_record(ByteReader& in) {
    WorldRecord r;
    const BodyAndModes which = read_body_and_modes(in);
    r.body = static_cast<int>(which.body);
    const auto flags = in.number<std::uint8_t>();
    if (flags > 15) throw DecodeError("flags of " + std::to_string(flags) + " in a record");
    r.asleep = flags & kAsleep, r.quarantined = flags & kQuarantined, r.at_limit = flags & kAtLimit;
    r.still_steps = in.number<std::uint16_t>();
    r.sleep_group = in.number<std::int32_t>();
    r.state = read_state(in, which.modes, flags & kBroken);
    return r;
}

}  // namespace

std::uint32_t body_and_modes(std::uint32_t body, Eigen::Index modes) {
    if (body >= kMostWorldBodies || modes > kMostModes)
        throw std::invalid_argument("body " + std::to_string(body) + " with " + std::to_string(modes) +
                                    " modes: messages hold bodies below 2^24, 128 modes");
    return body | static_cast<std::uint32_t>(modes) << 24;
}

BodyAndModes read_body_and_modes(ByteReader& in) {
    const auto both = in.number<std::uint32_t>();
    const BodyAndModes which{both & (kMostWorldBodies - 1), static_cast<int>(both >> 24)};
    if (which.modes > kMostModes)
        throw DecodeError(std::to_string(which.modes) + " modes, expected 0 to 128");
    return which;
}

bool is_broken(const WorldBodyState& s) {
    const double turn = s.orientation.squaredNorm();
    const bool whole = s.position.cwiseAbs().maxCoeff() <= kFurthest && s.position.allFinite() &&
                       s.velocity.cwiseAbs().maxCoeff() <= kFastest && s.velocity.allFinite() && turn > 0.5 &&
                       turn < 2 && s.angular_momentum.allFinite() && s.q.allFinite() && s.q_dot.allFinite();
    return !whole;
}

void write(ByteWriter& out, const std::vector<WorldRecord>& records) {
    out.count(records.size());
    for (const WorldRecord& r : records) write(out, r);
}

std::vector<WorldRecord> read_world_records(ByteReader& in) {
    std::vector<WorldRecord> records(in.count(kSmallestRecord));
    for (WorldRecord& r : records) r = read_record(in);
    return records;
}

}  // namespace sim
