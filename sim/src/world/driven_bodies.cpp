#include <algorithm>

#include "world/world_implementation.h"

// Bodies that move as prescribed.

namespace sim {

// At the end of a step, or the start, with the velocity that it came with.
void World::Implementation::place_driven(MovingBody& body) {
    const double time = static_cast<double>(counts.steps) * settings.dt;
    set_driven(body, state_at(body.motion, time));
}

void World::Implementation::set_driven(MovingBody& body, const PrescribedState& now) {
    WorldBodyState& s = body.state;
    s.position = now.pose.position, s.orientation = now.pose.orientation, s.velocity = now.velocity;
    const Eigen::Matrix3d r = s.orientation.toRotationMatrix();
    s.angular_momentum = r * body.kind->mass.inertia.cwiseProduct(r.transpose() * now.spin);
    pose(body);
}

// Before a step: their paths, and who is woken by joints.
void World::Implementation::begin_motions() {
    contacts.paths().resize(bodies.size());
    const double begins = static_cast<double>(counts.steps - 1) * settings.dt;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        MovingBody& body = bodies[i];
        if (body.motion.empty()) continue;
        BodyPath& path = contacts.paths()[i];
        follow_motion(body.motion, begins, settings.dt, path);
        const BodyPath::Leg& first = path.legs.front();
        set_driven(body, {{first.position, first.orientation}, first.velocity, first.spin});
        body.driven = std::ranges::any_of(path.legs, [](const BodyPath::Leg& leg) {
            return !leg.velocity.isZero(0) || !leg.spin.isZero(0);
        });
    }
    for (const HeldConstraint& c : constraints) {
        const int a = c.definition.body_a, b = c.definition.body_b;
        if (!c.holds || b < 0) continue;
        for (const auto& [one, other] : {std::pair(a, b), std::pair(b, a)})
            if (bodies[static_cast<std::size_t>(one)].driven &&
                bodies[static_cast<std::size_t>(other)].asleep)
                wake_group(bodies, other);
    }
}

void World::Implementation::end_motions() {
    for (MovingBody& body : bodies)
        if (!body.motion.empty()) place_driven(body);
}

}  // namespace sim
