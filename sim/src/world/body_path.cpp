#include "world/body_path.h"

#include <algorithm>

namespace sim {

Eigen::Vector3d spin_of(const MovingBody& body, const Eigen::Quaterniond& orientation,
                        const Eigen::Vector3d& momentum) {
    const Eigen::Matrix3d r = orientation.toRotationMatrix();
    return r * (r.transpose() * momentum).cwiseQuotient(body.kind->mass.inertia);
}

BodyPath::Pose BodyPath::at(double time, double substep) const {
    const auto last = static_cast<double>(legs.size() - 1);
    const double place = std::clamp(time / substep, 0.0, last);
    const Leg& leg = legs[static_cast<std::size_t>(place)];
    const double gone = time - substep * static_cast<double>(static_cast<std::size_t>(place));
    const double rate = leg.spin.norm(), angle = rate * gone;
    Pose pose{leg.position + gone * leg.velocity, leg.orientation};
    if (angle > 0)
        pose.orientation =
            (Eigen::Quaterniond(Eigen::AngleAxisd(angle, leg.spin / rate)) * leg.orientation).normalized();
    return pose;
}

BodyPath::Way BodyPath::until(double time, double substep) const {
    Way way{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    double start = 0;
    for (const Leg& leg : legs) {
        const double span = std::clamp(time - start, 0.0, substep);
        way.moved += span * leg.velocity, way.turned += span * leg.spin;
        start += substep;
    }
    return way;
}

double BodyPath::length(double substep) const {
    double sum = 0;
    for (const Leg& leg : legs) sum += substep * leg.velocity.norm();
    return sum;
}

double BodyPath::turn(double substep) const {
    double sum = 0;
    for (const Leg& leg : legs) sum += substep * leg.spin.norm();
    return sum;
}

void set_spins(const MovingBody& body, BodyPath& path) {
    for (BodyPath::Leg& leg : path.legs) leg.spin = spin_of(body, leg.orientation, leg.momentum);
}

void follow_freely(const MovingBody& body, const WorldSettings& settings, BodyPath& path) {
    path.legs.resize(static_cast<std::size_t>(settings.substeps));
    const bool still = !body.moves() || body.asleep;
    const double h = settings.dt / settings.substeps;
    Eigen::Vector3d position = body.state.position, velocity = body.state.velocity,
                    momentum = body.state.angular_momentum;
    Eigen::Vector3d acceleration = body.gravity_scale * settings.gravity;
    if (body.pushed) acceleration += body.force / body.kind->mass.mass;
    Eigen::Quaterniond orientation = body.state.orientation;
    for (BodyPath::Leg& leg : path.legs) {
        leg = {.position = position, .orientation = orientation};
        if (still) continue;
        velocity += h * acceleration;
        if (body.pushed) momentum += h * body.torque;
        leg.velocity = velocity;
        leg.spin = spin_of(body, orientation, momentum);
        position += h * velocity;
        orientation = body.substep_rotation.advance(orientation, momentum);
        velocity *= body.kind->substep_drag, momentum *= body.kind->substep_drag;
    }
}

}  // namespace sim
