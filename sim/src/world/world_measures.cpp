#include <bit>

#include "world/world_implementation.h"

// What is measured of a whole world: energy, momentum, a hash of all states.

namespace sim {

World::Energy World::energy() const {
    const Implementation& w = *implementation_;
    Energy e{0, 0, 0, 0};
    for (const MovingBody& body : w.bodies) {
        if (!body.moves()) continue;
        const WorldBodyState& s = body.state;
        const double mass = body.kind->mass.mass;
        const Eigen::Vector3d own = s.orientation.conjugate() * s.angular_momentum;
        e.kinetic += mass / 2 * s.velocity.squaredNorm() +
                     own.cwiseAbs2().cwiseQuotient(body.kind->mass.inertia).sum() / 2 +
                     s.q_dot.squaredNorm() / 2;
        e.potential -= mass * body.gravity_scale * w.settings.gravity.dot(s.position);
        e.elastic += s.q.cwiseProduct(body.kind->basis.omega).squaredNorm() / 2;
    }
    auto at = [&w](int body, const Eigen::Vector3d& rest) -> Eigen::Vector3d {
        const MovingBody& b = w.bodies[static_cast<std::size_t>(body)];
        PosedBody posed;
        posed.kind = b.kind;
        posed.set(b.state.position, b.state.orientation, b.state.q);
        return posed.position + posed.rotation * posed.deformed(rest);
    };
    for (const HeldConstraint& c : w.constraints) {
        if (!c.holds) continue;
        if (std::isinf(c.definition.stiffness)) continue;  // the ends are together
        const int b = c.definition.body_b;
        for (int i = 0; i < c.count; ++i) {
            const HeldPoint& point = c.points[static_cast<std::size_t>(i)];
            const Eigen::Vector3d gap =
                point.gap(at(c.definition.body_a, point.a), b < 0 ? point.b : at(b, point.b),
                          b < 0 ? Eigen::Quaterniond::Identity()
                                : w.bodies[static_cast<std::size_t>(b)].state.orientation);
            e.springs += c.definition.stiffness / 2 * gap.squaredNorm();
        }
    }
    return e;
}

Eigen::Vector3d World::momentum() const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const MovingBody& body : implementation_->bodies)
        if (body.moves()) sum += body.kind->mass.mass * body.state.velocity;
    return sum;
}

Eigen::Vector3d World::angular_momentum() const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const MovingBody& body : implementation_->bodies)
        if (body.moves())
            sum += body.state.angular_momentum +
                   body.kind->mass.mass * body.state.position.cross(body.state.velocity);
    return sum;
}

Eigen::Vector3d World::outside_impulse() const {
    return implementation_->outside;
}

std::uint64_t World::state_hash() const {
    std::uint64_t hash = 0xcbf29ce484222325u;
    auto mix = [&hash](double value) {
        std::uint64_t bits = std::bit_cast<std::uint64_t>(value);
        for (int byte = 0; byte < 8; ++byte, bits >>= 8) hash = (hash ^ (bits & 255)) * 0x100000001b3u;
    };
    for (const MovingBody& body : implementation_->bodies) {
        const WorldBodyState& s = body.state;
        for (int i = 0; i < 3; ++i) mix(s.position[i]);
        mix(s.orientation.w()), mix(s.orientation.x()), mix(s.orientation.y()), mix(s.orientation.z());
        for (int i = 0; i < 3; ++i) mix(s.velocity[i]);
        for (int i = 0; i < 3; ++i) mix(s.angular_momentum[i]);
        for (const double q : s.q) mix(q);
        for (const double q : s.q_dot) mix(q);
    }
    return hash;
}

}  // namespace sim
