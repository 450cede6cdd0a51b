#include "body/body_path.h"

#include <algorithm>

#include "body/free_rotation.h"

namespace sim {

Eigen::Vector3d spin_of(const MovingBody& body, const Eigen::Quaterniond& orientation,
                        const Eigen::Vector3d& momentum) {
    const Eigen::Matrix3d r = orientation.toRotationMatrix();
    return r * (r.transpose() * momentum).cwiseQuotient(body.kind->mass.inertia);
}

BodyPath::Pose BodyPath::at(double time) const {
    const Leg& leg = leg_at(time);
    const double gone = time - leg.start;
    return {leg.position + gone * leg.velocity, rotate_freely(leg.orientation, leg.momentum, inertia, gone)};
}

BodyPath::Way BodyPath::until(double time) const {
    Way way{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    for (std::size_t i = 0; i < legs.size() && legs[i].start < time; ++i) {
        const double span = std::min(time, end_of(i)) - legs[i].start;
        way.moved += span * legs[i].velocity, way.turned += span * legs[i].spin;
    }
    return way;
}

void set_spins(const MovingBody& body, BodyPath& path) {
    for (BodyPath::Leg& leg : path.legs) leg.spin = spin_of(body, leg.orientation, leg.momentum);
}

void follow_freely(const MovingBody& body, const WorldBodyState& from, const WorldSettings& settings,
                   BodyPath& path) {
    path.legs.resize(static_cast<std::size_t>(settings.substeps));
    path.end = settings.dt;
    path.inertia = body.kind->mass.inertia;
    double start = 0;
    const bool still = !body.moves() || body.asleep;
    const double h = settings.dt / settings.substeps;
    Eigen::Vector3d position = from.position, velocity = from.velocity, momentum = from.angular_momentum;
    Eigen::Vector3d acceleration = body.gravity_scale * settings.gravity;
    if (body.pushed) acceleration += body.force / body.kind->mass.mass;
    Eigen::Quaterniond orientation = from.orientation;
    for (BodyPath::Leg& leg : path.legs) {
        leg = {.start = start, .position = position, .orientation = orientation};
        start += h;
        if (still) continue;
        velocity += h * acceleration;
        if (body.pushed) momentum += h * body.torque;
        leg.velocity = velocity, leg.momentum = momentum;
        leg.spin = spin_of(body, orientation, momentum);
        position += h * velocity;
        orientation = body.substep_rotation.advance(orientation, momentum);
        const double drag = body.kind->substeps.front().drag;
        velocity *= drag, momentum *= drag;
    }
}

}  // namespace sim
