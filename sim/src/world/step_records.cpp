#include "world/step_records.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr std::uint8_t kAtLimit = 1, kLimitedNow = 2;

void write_vector(ByteWriter& out, const Eigen::Vector3f& v) {
    write_floats(out, {v.data(), 3});
}
void read_vector(ByteReader& in, Eigen::Vector3f& v) {
    read_floats(in, {v.data(), 3});
}

[[noreturn]] void refuse_infinite() {
    throw DecodeError("a number that is not finite in a part of a step");
}

void write_numbers(ByteWriter& out, const double* numbers, Eigen::Index count) {
    out.append({reinterpret_cast<const std::uint8_t*>(numbers), static_cast<std::size_t>(count) * 8});
}
void read_numbers(ByteReader& in, double* numbers, Eigen::Index count) {
    const std::size_t bytes = static_cast<std::size_t>(count) * 8;
    if (bytes > 0) std::memcpy(numbers, in.take(bytes).data(), bytes);
    if (!std::all_of(numbers, numbers + count, [](double x) { return std::isfinite(x); })) refuse_infinite();
}

// A sample of a body, or -1.
int read_sample(ByteReader& in, int body, const std::vector<MovingBody>& bodies) {
    const int sample = in.number<std::int32_t>();
    const int samples = body < kFirstPlane ? bodies[static_cast<std::size_t>(body)].kind->samples : 0;
    if (sample < -1 || sample >= samples)
        throw DecodeError("a contact at sample " + std::to_string(sample) + ", expected one below " +
                          std::to_string(samples));
    return sample;
}

}  // namespace

void write_floats(ByteWriter& out, std::span<const float> floats) {
    out.append({reinterpret_cast<const std::uint8_t*>(floats.data()), floats.size_bytes()});
}

void read_floats(ByteReader& in, std::span<float> floats) {
    std::memcpy(floats.data(), in.take(floats.size_bytes()).data(), floats.size_bytes());
    if (!std::ranges::all_of(floats, [](float x) { return std::isfinite(x); })) refuse_infinite();
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
    for (int i = 0; i < m.count; ++i) {
        const ManifoldPoint& p = m.points[static_cast<std::size_t>(i)];
        out.number(p.feature), out.number(p.separation);
        for (const Eigen::Vector3f* v :
             {&p.normal, &p.arm_a, &p.arm_b, &p.rest_a, &p.rest_b, &p.friction_impulse})
            write_vector(out, *v);
        out.number(p.sample_a), out.number(p.sample_b);
        for (const float x : {p.begins, p.gap, p.normal_impulse}) out.number(x);
    }
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
    for (float* x : {&m.friction, &m.restitution, &m.impulse_reach}) read_floats(in, {x, 1});
    for (int i = 0; i < m.count; ++i) {
        ManifoldPoint& p = m.points[static_cast<std::size_t>(i)];
        p.feature = in.number<std::uint32_t>();
        read_floats(in, {&p.separation, 1});
        for (Eigen::Vector3f* v : {&p.normal, &p.arm_a, &p.arm_b, &p.rest_a, &p.rest_b, &p.friction_impulse})
            read_vector(in, *v);
        p.sample_a = read_sample(in, m.a, bodies), p.sample_b = read_sample(in, m.b, bodies);
        p.begins = in.number<float>();  // infinite: it does not happen
        if (std::isnan(p.begins)) refuse_infinite();
        for (float* x : {&p.gap, &p.normal_impulse}) read_floats(in, {x, 1});
    }
}

void write_impulses(ByteWriter& out, const Manifold& m) {
    for (int i = 0; i < m.count; ++i) {
        const ManifoldPoint& p = m.points[static_cast<std::size_t>(i)];
        out.number(p.normal_impulse);
        write_vector(out, p.friction_impulse);
    }
}

void read_impulses(ByteReader& in, Manifold& m) {
    for (int i = 0; i < m.count; ++i) {
        ManifoldPoint& p = m.points[static_cast<std::size_t>(i)];
        read_floats(in, {&p.normal_impulse, 1});
        read_vector(in, p.friction_impulse);
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
    read_numbers(in, s.position.data(), 3), read_numbers(in, s.orientation.coeffs().data(), 4);
    read_numbers(in, s.velocity.data(), 3), read_numbers(in, s.angular_momentum.data(), 3);
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
