#include "world/step_records.h"

#include <array>
#include <bit>
#include <cmath>
#include <utility>

namespace sim {
namespace {

constexpr std::uint8_t kAtLimit = 1, kLimitedNow = 2;

/// Throws if one is not finite. Without branches, since there are many.
template <typename Number, typename Bits>
void expect_finite(const Number* numbers, std::size_t count, Bits exponent) {
    Bits any = 0;
    for (std::size_t i = 0; i < count; ++i)
        any |= static_cast<Bits>((std::bit_cast<Bits>(numbers[i]) & exponent) == exponent);
    if (any != 0) throw DecodeError("a number that is not finite in a part of a step");
}
void expect_finite(const float* numbers, std::size_t count) {
    expect_finite<float, std::uint32_t>(numbers, count, 0x7f800000u);
}
void expect_finite(const double* numbers, std::size_t count) {
    expect_finite<double, std::uint64_t>(numbers, count, 0x7ff0000000000000u);
}

/// A point: its integers, then all else.
struct PackedPoint {
    std::uint32_t feature;
    std::int32_t sample_a, sample_b;
    float begins;
    std::array<float, 21> numbers;  // six vectors, then what is one number
};
static_assert(sizeof(PackedPoint) == 100 && std::is_trivially_copyable_v<PackedPoint>);

template <typename Point>  // may be const
auto vectors_of(Point& p) {
    return std::array{&p.normal, &p.arm_a, &p.arm_b, &p.rest_a, &p.rest_b, &p.friction_impulse};
}

PackedPoint packed(const ManifoldPoint& p) {
    PackedPoint out{p.feature, p.sample_a, p.sample_b, p.begins, {}};
    std::size_t at = 0;
    for (const Eigen::Vector3f* vector : vectors_of(p))
        for (int k = 0; k < 3; ++k) out.numbers[at++] = (*vector)[k];
    for (const float number : {p.separation, p.gap, p.normal_impulse}) out.numbers[at++] = number;
    return out;
}

void unpack(const PackedPoint& from, ManifoldPoint& p) {
    p.feature = from.feature, p.sample_a = from.sample_a, p.sample_b = from.sample_b, p.begins = from.begins;
    std::size_t at = 0;
    for (Eigen::Vector3f* vector : vectors_of(p))
        for (int k = 0; k < 3; ++k) (*vector)[k] = from.numbers[at++];
    for (float* number : {&p.separation, &p.gap, &p.normal_impulse}) *number = from.numbers[at++];
}

constexpr std::size_t kBytesOfImpulses = 16;  // of a point

void set_impulses(const std::uint8_t* from, ManifoldPoint& point) {
    std::array<float, 4> impulses;
    std::memcpy(impulses.data(), from, kBytesOfImpulses);
    point.normal_impulse = impulses[0];
    point.friction_impulse = {impulses[1], impulses[2], impulses[3]};
}

void write_numbers(ByteWriter& out, const double* numbers, Eigen::Index count) {
    out.append({reinterpret_cast<const std::uint8_t*>(numbers), static_cast<std::size_t>(count) * 8});
}
void read_numbers(ByteReader& in, double* numbers, Eigen::Index count) {
    const std::size_t bytes = static_cast<std::size_t>(count) * 8;
    if (bytes > 0) std::memcpy(numbers, in.take(bytes).data(), bytes);
    expect_finite(numbers, static_cast<std::size_t>(count));
}

PackedPoint point_at(const std::uint8_t* bytes) {
    PackedPoint point;
    std::memcpy(&point, bytes, sizeof point);
    return point;
}

// A sample of a body that has so many, or -1.
void expect_sample(int sample, int samples) {
    if (sample < -1 || sample >= samples)
        throw DecodeError("a contact at sample " + std::to_string(sample) + ", expected one below " +
                          std::to_string(samples));
}

}  // namespace

void write_floats(ByteWriter& out, std::span<const float> floats) {
    out.append({reinterpret_cast<const std::uint8_t*>(floats.data()), floats.size_bytes()});
}

void read_floats(ByteReader& in, std::span<float> floats) {
    std::memcpy(floats.data(), in.take(floats.size_bytes()).data(), floats.size_bytes());
    expect_finite(floats.data(), floats.size());
}

double read_finite(ByteReader& in) {
    double number = 0;
    read_numbers(in, &number, 1);
    return number;
}

void write(ByteWriter& out, const Manifold& m) {
    out.number(m.a), out.number(m.b);
    out.number(static_cast<std::uint8_t>(m.count)), out.number<std::uint8_t>(m.emerging);
    for (const float x : {m.friction, m.restitution, m.impulse_reach}) out.number(x);
    for (int i = 0; i < m.count; ++i)
        out.append(std::bit_cast<std::array<std::uint8_t, sizeof(PackedPoint)>>(
            packed(m.points[static_cast<std::size_t>(i)])));
}

void read(ByteReader& in, Manifold& m, const std::vector<MovingBody>& bodies, std::size_t planes) {
    const auto count = static_cast<int>(bodies.size());
    m.a = in.number<std::int32_t>(), m.b = in.number<std::int32_t>();
    m.count = in.number<std::uint8_t>(), m.emerging = in.flag();
    const bool on_plane = m.b >= kFirstPlane && static_cast<std::size_t>(m.b - kFirstPlane) < planes;
    if (m.a < 0 || m.a >= count || m.b <= m.a || (m.b >= count && !on_plane) || m.count < 1 ||
        m.count > kManifoldPoints)
        throw DecodeError("a contact of " + std::to_string(m.count) + " points between bodies " +
                          std::to_string(m.a) + " and " + std::to_string(m.b) + " of " +
                          std::to_string(count));
    if (!bodies[static_cast<std::size_t>(m.a)].moves() &&
        (on_plane || !bodies[static_cast<std::size_t>(m.b)].moves()))
        throw DecodeError("a contact of what does not move");
    for (float* x : {&m.friction, &m.restitution, &m.impulse_reach}) read_floats(in, {x, 1});
    m.packed_points = in.take(sizeof(PackedPoint) * static_cast<std::size_t>(m.count)).data();
    m.packed_impulses = nullptr;
    const auto samples_of = [&](int body) {
        return body < kFirstPlane ? bodies[static_cast<std::size_t>(body)].kind->samples : 0;
    };
    const int samples_a = samples_of(m.a), samples_b = samples_of(m.b);
    for (std::size_t i = 0; i < static_cast<std::size_t>(m.count); ++i) {
        const PackedPoint p = point_at(m.packed_points + i * sizeof(PackedPoint));
        if (i == 0) m.points[0].begins = p.begins;
        if (!std::isinf(p.begins)) expect_finite(&p.begins, 1);  // infinite: it does not happen
        expect_finite(p.numbers.data(), p.numbers.size());
        expect_sample(p.sample_a, samples_a), expect_sample(p.sample_b, samples_b);
    }
}

void unpack_points(Manifold& m) {
    const auto count = static_cast<std::size_t>(m.count);
    const std::uint8_t* from = std::exchange(m.packed_points, nullptr);
    for (std::size_t i = 0; i < count; ++i) unpack(point_at(from + i * sizeof(PackedPoint)), m.points[i]);
    if (const std::uint8_t* impulses = std::exchange(m.packed_impulses, nullptr))
        for (std::size_t i = 0; i < count; ++i) set_impulses(impulses + i * kBytesOfImpulses, m.points[i]);
}

std::uint64_t skip_manifold(ByteReader& in) {
    Manifold m;
    m.a = in.number<std::int32_t>(), m.b = in.number<std::int32_t>();
    m.count = in.number<std::uint8_t>();
    (void)in.take(13 + sizeof(PackedPoint) * static_cast<std::size_t>(m.count));
    return m.key();
}

void write_impulses(ByteWriter& out, const Manifold& m) {
    for (int i = 0; i < m.count; ++i) {
        const ManifoldPoint& p = m.points[static_cast<std::size_t>(i)];
        const Eigen::Vector3f& friction = p.friction_impulse;
        write_floats(out, std::array{p.normal_impulse, friction[0], friction[1], friction[2]});
    }
}

void read_impulses(ByteReader& in, Manifold& m) {
    const auto count = static_cast<std::size_t>(m.count);
    const std::uint8_t* from = in.take(kBytesOfImpulses * count).data();
    std::array<float, 4 * kManifoldPoints> numbers{};
    std::memcpy(numbers.data(), from, kBytesOfImpulses * count);
    expect_finite(numbers.data(), numbers.size());
    if (m.packed_points) {
        m.packed_impulses = from;
    } else {
        for (std::size_t i = 0; i < count; ++i) set_impulses(from + i * kBytesOfImpulses, m.points[i]);
    }
}

void write(ByteWriter& out, const MovingBody& body) {
    const WorldBodyState& s = body.state;
    out.number(
        static_cast<std::uint8_t>((body.at_limit ? kAtLimit : 0) | (body.limited_now ? kLimitedNow : 0)));
    write_numbers(out, s.position.data(), 3), write_numbers(out, s.orientation.coeffs().data(), 4);
    write_numbers(out, s.velocity.data(), 3), write_numbers(out, s.angular_momentum.data(), 3);
    write_numbers(out, s.q.data(), s.q.size()), write_numbers(out, s.q_dot.data(), s.q_dot.size());
}

void read(ByteReader& in, MovingBody& body) {
    WorldBodyState& s = body.state;
    const auto flags = in.number<std::uint8_t>();
    body.at_limit = flags & kAtLimit, body.limited_now = flags & kLimitedNow;
    using Rigid = std::array<double, 13>;
    const auto rigid = std::bit_cast<Rigid>(in.bytes<sizeof(Rigid)>());
    expect_finite(rigid.data(), rigid.size());
    s.position = Eigen::Vector3d::Map(rigid.data());
    s.orientation.coeffs() = Eigen::Vector4d::Map(rigid.data() + 3);
    s.velocity = Eigen::Vector3d::Map(rigid.data() + 7);
    s.angular_momentum = Eigen::Vector3d::Map(rigid.data() + 10);
    read_numbers(in, s.q.data(), s.q.size()), read_numbers(in, s.q_dot.data(), s.q_dot.size());
}

void write(ByteWriter& out, const BodyPath& path) {
    out.count(path.legs.size());
    for (const BodyPath::Leg& leg : path.legs) {
        out.number(leg.start);
        write_numbers(out, leg.position.data(), 3), write_numbers(out, leg.orientation.coeffs().data(), 4);
        write_numbers(out, leg.velocity.data(), 3), write_numbers(out, leg.momentum.data(), 3);
    }
}

void read(ByteReader& in, BodyPath& path, double dt) {
    path.legs.resize(in.count(8 * 14));
    path.end = dt;
    double before = -1;
    for (BodyPath::Leg& leg : path.legs) {
        leg.start = read_finite(in);
        if (!(leg.start > before && leg.start < dt))
            throw DecodeError("legs of a path that do not ascend within the step");
        before = leg.start;
        read_numbers(in, leg.position.data(), 3), read_numbers(in, leg.orientation.coeffs().data(), 4);
        read_numbers(in, leg.velocity.data(), 3), read_numbers(in, leg.momentum.data(), 3);
    }
    if (path.legs.empty() || path.legs.front().start < 0) throw DecodeError("a path without a beginning");
}

}  // namespace sim
