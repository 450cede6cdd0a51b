#include "world/body_path.h"

#include <algorithm>

#include "world/free_rotation.h"

namespace sim {
namespace {

// Free rotation is split into parts of about so much.
constexpr double kPart = 0.5;  // [rad]
constexpr int kMostParts = 16;

}  // namespace

Eigen::Vector3d spin_of(const MovingBody& body, const Eigen::Quaterniond& orientation,
                        const Eigen::Vector3d& momentum) {
    const Eigen::Matrix3d r = orientation.toRotationMatrix();
    return r * (r.transpose() * momentum).cwiseQuotient(body.kind->mass.inertia);
}

Eigen::Quaterniond turned_freely(const Eigen::Quaterniond& orientation, const Eigen::Vector3d& momentum,
                                 const Eigen::Vector3d& inertia, double time) {
    const double most = momentum.norm() / inertia.minCoeff() * time;
    if (!(most > 0)) return orientation;
    const int parts = std::clamp(static_cast<int>(most / kPart), 1, kMostParts);
    const FreeRotation part(inertia, time / parts);
    Eigen::Quaterniond turned = orientation;
    for (int i = 0; i < parts; ++i) turned = part.advance(turned, momentum);
    return turned;
}

BodyPath::Pose BodyPath::at(double time) const {
    const Leg& leg = leg_at(time);
    const double gone = time - leg.start;
    return {leg.position + gone * leg.velocity, turned_freely(leg.orientation, leg.momentum, inertia, gone)};
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

void follow_freely(const MovingBody& body, const WorldSettings& settings, BodyPath& path) {
    path.legs.resize(static_cast<std::size_t>(settings.substeps));
    path.end = settings.dt;
    path.inertia = body.kind->mass.inertia;
    double start = 0;
    const bool still = !body.moves() || body.asleep;
    const double h = settings.dt / settings.substeps;
    Eigen::Vector3d position = body.state.position, velocity = body.state.velocity,
                    momentum = body.state.angular_momentum;
    Eigen::Vector3d acceleration = body.gravity_scale * settings.gravity;
    if (body.pushed) acceleration += body.force / body.kind->mass.mass;
    Eigen::Quaterniond orientation = body.state.orientation;
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
