#include "messages/update_codec.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "body/body_kind.h"
#include "messages/world_record_codec.h"

namespace sim {
namespace {

constexpr std::uint8_t kUpdateAsleep = 1, kUpdateStill = 2, kUpdateQuarantined = 4, kUpdateHeld = 8;
constexpr std::size_t kSmallestUpdate = 36, kCrossed = 33, kUsualUpdate = 98;
constexpr std::uint32_t kRebound = 1U << 31;
constexpr std::int16_t kUpdateBroken = std::numeric_limits<std::int16_t>::min();

/// Room for one update: what ByteWriter does, without growing by each number.
class SmallWriter {
public:
    template <typename Number>
    void number(Number value) {
        std::memcpy(bytes_.data() + size_, &value, sizeof value);
        size_ += sizeof value;
    }
    void append(std::span<const std::uint8_t> more) {
        std::copy(more.begin(), more.end(), bytes_.begin() + static_cast<std::ptrdiff_t>(size_));
        size_ += more.size();
    }
    [[nodiscard]] std::span<const std::uint8_t> bytes() const { return {bytes_.data(), size_}; }

private:
    std::array<std::uint8_t, kSmallestUpdate + 14 + 4 * kMostModes> bytes_;
    std::size_t size_ = 0;
};

/// One update's bytes, whose length was checked.
class SmallReader {
public:
    explicit SmallReader(std::span<const std::uint8_t> bytes) : at_(bytes.data()) {}
    template <typename Number>
    [[nodiscard]] Number number() {
        Number value;
        std::memcpy(&value, at_, sizeof value);
        at_ += sizeof value;
        return value;
    }
    [[nodiscard]] const std::uint8_t* take(std::size_t n) { return std::exchange(at_, at_ + n); }

private:
    const std::uint8_t* at_;
};

// f16: Eigen::half, by the processor where it can.

constexpr float kLargestHalf = 65504;

void write_half(SmallWriter& out, double value) {
    const float bounded =
        std::isnan(value) ? 0 : std::clamp(static_cast<float>(value), -kLargestHalf, kLargestHalf);
    out.number(Eigen::numext::bit_cast<std::uint16_t>(Eigen::half(bounded)));
}

double read_half(SmallReader& in) {
    const auto bits = in.number<std::uint16_t>();
    if ((bits & 0x7C00) == 0x7C00) throw DecodeError("a number that is not finite");
    return static_cast<float>(Eigen::numext::bit_cast<Eigen::half>(bits));
}

template <typename Vector>
void write_halves(SmallWriter& out, const Vector& v, bool zeros = false) {
    for (Eigen::Index i = 0; i < v.size(); ++i) write_half(out, zeros ? 0.0 : v[i]);
}

template <typename Vector>
void read_halves(SmallReader& in, Vector& v) {
    for (Eigen::Index i = 0; i < v.size(); ++i) v[i] = read_half(in);
}

// Small numbers of one kind: bytes, and the power of two by which they count: the least with which none is
// beyond 127.

std::size_t bytes_of_small(std::size_t numbers) {
    return numbers > 0 ? 1 + numbers : 0;
}

void write_small(SmallWriter& out, const Eigen::VectorXd& v, Eigen::Index n, bool zeros = false) {
    if (n == 0) return;
    const auto at = [&](Eigen::Index i) { return zeros || i >= v.size() || std::isnan(v[i]) ? 0.0 : v[i]; };
    double most = 0;
    for (Eigen::Index i = 0; i < n; ++i) most = std::max(most, std::abs(at(i)));
    int exponent = -128;
    if (most > 0) {
        (void)std::frexp(most, &exponent);  // most in [2^(exponent - 1), 2^exponent)
        exponent -= 7;
        if (most > std::ldexp(127.0, exponent)) ++exponent;
    }
    exponent = std::clamp(exponent, -128, 127);
    out.number(static_cast<std::int8_t>(exponent));
    for (Eigen::Index i = 0; i < n; ++i)
        out.number(
            static_cast<std::int8_t>(std::clamp(std::rint(std::ldexp(at(i), -exponent)), -127.0, 127.0)));
}

void read_small(SmallReader& in, Eigen::VectorXd& v) {
    if (v.size() == 0) return;
    const double unit = std::ldexp(1.0, in.number<std::int8_t>());
    int most = 0;
    for (double& x : v) {
        const int number = in.number<std::int8_t>();
        most = std::max(most, std::abs(number));
        x = unit * number;
    }
    const bool least = most >= 64 || unit == std::ldexp(1.0, -128);
    if (most > 127 || !least) throw DecodeError("numbers that are not as small as they can be");
}

// Floats of a place or an impulse.

template <typename Writer, typename Vector>
void write_floats(Writer& out, const Vector& v) {
    constexpr double most = std::numeric_limits<float>::max();
    for (Eigen::Index i = 0; i < v.size(); ++i)
        out.number(std::isnan(v[i]) ? 0 : static_cast<float>(std::clamp<double>(v[i], -most, most)));
}

template <typename Reader, typename Vector>
void read_floats(Reader& in, Vector& v) {
    for (Eigen::Index i = 0; i < v.size(); ++i) {
        v[i] = in.template number<float>();
        if (!std::isfinite(v[i])) throw DecodeError("a number that is not finite");
    }
}

// Orientation: the three smaller components.

constexpr double kMostOfSmaller = 0.70710678118654752440;
constexpr std::uint64_t kLevels = (1u << 18) - 1;

void write_orientation(SmallWriter& out, const Eigen::Quaterniond& orientation) {
    Eigen::Vector4d c = orientation.coeffs().normalized();  // x, y, z, w
    Eigen::Index largest = 0;
    c.cwiseAbs().maxCoeff(&largest);
    if (c[largest] < 0) c = -c;
    std::uint64_t bits = static_cast<std::uint64_t>(largest);
    int at = 2;
    for (Eigen::Index i = 0; i < 4; ++i) {
        if (i == largest) continue;
        const double share = std::clamp((c[i] / kMostOfSmaller + 1) / 2, 0.0, 1.0);
        bits |= static_cast<std::uint64_t>(std::llround(share * double(kLevels))) << at;
        at += 18;
    }
    std::array<std::uint8_t, 8> bytes;
    std::memcpy(bytes.data(), &bits, 8);
    out.append(std::span(bytes).first(7));
}

Eigen::Quaterniond read_orientation(SmallReader& in) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, in.take(7), 7);
    const auto largest = static_cast<Eigen::Index>(bits & 3);
    Eigen::Vector4d c;
    double rest = 1, most = 0;
    int at = 2;
    for (Eigen::Index i = 0; i < 4; ++i) {
        if (i == largest) continue;
        c[i] = (2 * (double((bits >> at) & kLevels) / double(kLevels)) - 1) * kMostOfSmaller;
        rest -= c[i] * c[i], most = std::max(most, std::abs(c[i]));
        at += 18;
    }
    c[largest] = std::sqrt(std::max(0.0, rest));
    if (c[largest] < most - 2e-5) throw DecodeError("an orientation that is none");
    return Eigen::Quaterniond(c).normalized();
}

// Angular momentum: three mantissas of 16 bits, one exponent of 4, to base 16.

struct SharedExponent {
    int exponent = 0;
    std::array<std::int16_t, 3> mantissas{};
};

/// 2^(4 exponent - 44)
constexpr double unit_of(int exponent) {
    return std::bit_cast<double>(static_cast<std::uint64_t>(1023 + 4 * exponent - 44) << 52);
}

SharedExponent quantised(const Eigen::Vector3d& v) {
    SharedExponent s;
    const double most = v.cwiseAbs().maxCoeff();
    while (s.exponent < 15 && std::rint(most / unit_of(s.exponent)) > 32767) ++s.exponent;
    for (int i = 0; i < 3; ++i)
        s.mantissas[static_cast<std::size_t>(i)] =
            static_cast<std::int16_t>(std::clamp(std::rint(v[i] / unit_of(s.exponent)), -32767.0, 32767.0));
    return s;
}

/// False: the mark of a broken state.
bool read_angular(SmallReader& in, int exponent, Eigen::Vector3d& v) {
    int most = 0, broken = 0;
    for (int i = 0; i < 3; ++i) {
        const auto m = in.number<std::int16_t>();
        most = std::max(most, std::abs(int(m))), broken += m == kUpdateBroken;
        v[i] = m * unit_of(exponent);
    }
    const bool smallest = exponent == 0 || most >= 2048;
    if (broken == 3 ? exponent != 0 : broken != 0 || !smallest)
        throw DecodeError("an angular momentum that is none");
    if (broken) v.setZero();
    return !broken;
}

void write(ByteWriter& all, const Update& u) {
    const WorldBodyState& s = u.state;
    SmallWriter out;
    const bool broken = is_broken(s), held = u.held && !broken;
    SharedExponent angular;
    broken ? angular.mantissas.fill(kUpdateBroken) : (void)(angular = quantised(s.angular_momentum));
    out.number(body_and_modes(u.body, s.q.size()));
    const int flags = (u.asleep ? kUpdateAsleep : 0) | (u.still ? kUpdateStill : 0) |
                      (u.quarantined ? kUpdateQuarantined : 0) | (held ? kUpdateHeld : 0);
    out.number(static_cast<std::uint8_t>(flags | angular.exponent << 4));
    const Eigen::Vector3d none = Eigen::Vector3d::Zero();
    write_floats(out, broken ? none : s.position);
    write_orientation(out, broken ? Eigen::Quaterniond::Identity() : s.orientation);
    write_halves(out, s.velocity, broken);
    for (const std::int16_t m : angular.mantissas) out.number(m);
    write_halves(out, s.q, broken);
    write_small(out, s.q_dot, s.q.size(), broken);
    if (held) {
        write_halves(out, u.impulse.linear);
        write_halves(out, u.impulse.angular);
        write_small(out, u.impulse.modal, s.q.size());
    }
    all.append(out.bytes());
}

void read_update(ByteReader& all, Update& u) {
    const BodyAndModes which = parted(all.number<std::uint32_t>());
    u.body = which.body;
    const auto flags = all.number<std::uint8_t>();
    const auto modes = static_cast<std::size_t>(which.modes);
    const std::size_t head = 5, small = bytes_of_small(modes), held = flags & kUpdateHeld ? 12 + small : 0;
    SmallReader in(all.take(kSmallestUpdate - head + 2 * modes + small + held));
    u.asleep = flags & kUpdateAsleep, u.still = flags & kUpdateStill,
    u.quarantined = flags & kUpdateQuarantined;
    u.held = flags & kUpdateHeld;
    WorldBodyState& s = u.state;
    read_floats(in, s.position);
    s.orientation = read_orientation(in);
    read_halves(in, s.velocity);
    const bool whole = read_angular(in, flags >> 4, s.angular_momentum);
    s.q.resize(which.modes), s.q_dot.resize(which.modes);
    read_halves(in, s.q);
    read_small(in, s.q_dot);
    if (is_broken(s)) throw DecodeError("an update out of range");
    if (!whole) s.position.setConstant(std::numeric_limits<double>::quiet_NaN());
    u.impulse.modal.resize(which.modes);
    if (!u.held) {
        u.impulse.set_zero();
        return;
    }
    read_halves(in, u.impulse.linear);
    read_halves(in, u.impulse.angular);
    read_small(in, u.impulse.modal);
}

}  // namespace

void write(ByteWriter& out, const std::vector<Update>& updates) {
    out.count(updates.size());
    out.bytes().reserve(out.bytes().size() + updates.size() * kUsualUpdate);
    for (const Update& u : updates) write(out, u);
}

Eigen::Vector3d angular_as_sent(const Eigen::Vector3d& v) {
    const SharedExponent s = quantised(v);
    return unit_of(s.exponent) * Eigen::Vector3d(s.mantissas[0], s.mantissas[1], s.mantissas[2]);
}

void write(ByteWriter& out, const std::vector<CrossImpulse>& crossed) {
    out.count(crossed.size());
    out.bytes().reserve(out.bytes().size() + crossed.size() * kCrossed);
    for (const CrossImpulse& c : crossed) {
        const SharedExponent own = quantised(c.angular_own), ghost = quantised(c.angular_ghost);
        out.number(static_cast<std::uint32_t>(c.own) | (c.rebound ? kRebound : 0));
        out.number(static_cast<std::uint32_t>(c.ghost));
        out.number(static_cast<std::uint8_t>(own.exponent | ghost.exponent << 4));
        write_floats(out, c.linear);
        for (const SharedExponent& s : {own, ghost})
            for (const std::int16_t m : s.mantissas) out.number(m);
    }
}

void read(ByteReader& in, std::vector<Update>& updates) {
    updates.resize(in.count(kSmallestUpdate));
    for (Update& u : updates) read_update(in, u);
}

void read(ByteReader& all, std::vector<CrossImpulse>& crossed) {
    crossed.resize(all.count(kCrossed));
    SmallReader in(all.take(kCrossed * crossed.size()));
    for (CrossImpulse& c : crossed) {
        const auto own = in.number<std::uint32_t>(), ghost = in.number<std::uint32_t>(),
                   body = own & ~kRebound;
        const auto exponents = in.number<std::uint8_t>();
        if (body >= kMostWorldBodies || ghost >= kMostWorldBodies || body == ghost)
            throw DecodeError("an impulse between bodies that is none");
        c.own = static_cast<int>(body), c.ghost = static_cast<int>(ghost), c.rebound = (own & kRebound) != 0;
        read_floats(in, c.linear);
        const bool whole = read_angular(in, exponents & 15, c.angular_own) &&
                           read_angular(in, exponents >> 4, c.angular_ghost);
        if (!whole) throw DecodeError("an impulse that is broken");
    }
}

namespace {

PackedUpdates::Place place_of(const Update& update, std::size_t offset) {
    const WorldBodyState& s = update.state;
    return {update.body,        static_cast<std::uint32_t>(offset),
            s.q.size(),         update.asleep,
            update.quarantined, s.position,
            s.velocity};
}

}  // namespace

void PackedUpdates::add(const Update& update) {
    ByteWriter out;
    std::swap(out.bytes(), bytes_);
    places_.push_back(place_of(update, out.bytes().size()));
    write(out, update);
    std::swap(out.bytes(), bytes_);
}

void PackedUpdates::add(const PackedUpdates& from, const Place& place) {
    const auto next = std::ranges::upper_bound(from.places_, place.offset, {}, &Place::offset);
    const std::size_t end = next == from.places_.end() ? from.bytes_.size() : next->offset;
    places_.push_back(place);
    places_.back().offset = static_cast<std::uint32_t>(bytes_.size());
    bytes_.insert(bytes_.end(), from.bytes_.begin() + place.offset,
                  from.bytes_.begin() + static_cast<std::ptrdiff_t>(end));
}

void PackedUpdates::read(ByteReader& in) {
    places_.resize(in.count(kSmallestUpdate));
    const std::span<const std::uint8_t> all = in.rest();
    thread_local Update update;
    for (Place& place : places_) {
        const std::size_t offset = all.size() - in.left();
        read_update(in, update);
        place = place_of(update, offset);
    }
    const auto used = all.first(all.size() - in.left());
    bytes_.assign(used.begin(), used.end());
}

void write(ByteWriter& out, const PackedUpdates& updates) {
    out.count(updates.places().size());
    out.append(updates.bytes());
}

void read(ByteReader& in, PackedUpdates& updates) {
    updates.read(in);
}

void PackedUpdates::read(const Place& place, Update& into) const {
    ByteReader in(std::span<const std::uint8_t>(bytes_).subspan(place.offset));
    read_update(in, into);
}

}  // namespace sim
