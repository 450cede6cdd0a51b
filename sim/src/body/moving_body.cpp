#include "body/moving_body.h"

#include <cmath>

namespace sim {
namespace {

// Largest |du/dr| over the probes.
double largest_gradient(const MovingBody& body) {
    const BodyKind& kind = *body.kind;
    Lanes largest = lanes_of(0);
    for (int p = 0; p < kProbes; p += kLanes) {
        Lanes square = lanes_of(0);
        for (int e = 0; e < 9; ++e) {
            Lanes sum = lanes_of(0);
            for (int k = 0; k < kind.modes; ++k)
                sum += static_cast<float>(body.state.q[k]) *
                       load_lanes(kind.gradients.data() + (k * 9 + e) * kProbes + p);
            square += sum * sum;
        }
        largest = square > largest ? square : largest;
    }
    float top = 0;
    for (int lane = 0; lane < kLanes; ++lane) top = std::max(top, largest[lane]);
    return std::sqrt(top);
}

}  // namespace

MovingBody moving_body(const WorldBody& definition, const BodyKind& kind, const WorldSettings& settings) {
    MovingBody body;
    body.kind = &kind;
    body.fixed = !definition.moves();
    body.motion = definition.motion;
    body.gravity_scale = definition.gravity_scale;
    body.friction = static_cast<float>(definition.friction);
    body.restitution = static_cast<float>(definition.restitution);
    const Eigen::Quaterniond orientation(definition.world_from_body.rotation());
    const Eigen::Matrix3d r = orientation.toRotationMatrix();
    const Eigen::Vector3d momentum =
        r * kind.mass.inertia.cwiseProduct(r.transpose() * definition.angular_velocity);
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(kind.modes);
    body.state = {definition.world_from_body.translation(),
                  orientation,
                  body.fixed ? Eigen::Vector3d::Zero() : definition.velocity,
                  body.fixed ? Eigen::Vector3d::Zero() : momentum,
                  zero,
                  zero};
    body.posed.kind = &kind;
    body.substep_rotation = FreeRotation(kind.mass.inertia, settings.dt / settings.substeps);
    body.step_rotation = FreeRotation(kind.mass.inertia, settings.dt);
    body.modal_force = zero;
    body.given.modal = zero;
    return body;
}

void move_freely(MovingBody& body, const WorldSettings& settings) {
    WorldBodyState& s = body.state;
    const double dt = settings.dt;
    Eigen::Vector3d acceleration = body.gravity_scale * settings.gravity;
    if (body.pushed) acceleration += body.force / body.kind->mass.mass;
    // v' = a - alpha v over dt, exactly: with alpha = 0 the parabola.
    const double alpha = body.kind->definition.damping_alpha, drag = body.kind->step_drag;
    if (alpha * dt < 1e-6) {
        s.position += dt * s.velocity + dt * dt / 2 * acceleration;
        s.velocity += dt * acceleration;
    } else {
        const Eigen::Vector3d terminal = acceleration / alpha;
        s.position += dt * terminal + (1 - drag) / alpha * (s.velocity - terminal);
        s.velocity = terminal + drag * (s.velocity - terminal);
    }
    // Half the torque's impulse and of the drag before the turn, half after it.
    const double half_drag = std::sqrt(drag);
    s.angular_momentum *= half_drag;
    if (body.pushed) s.angular_momentum += dt / 2 * body.torque;
    s.orientation = body.step_rotation.advance(s.orientation, s.angular_momentum);
    if (body.pushed) s.angular_momentum += dt / 2 * body.torque;
    s.angular_momentum *= half_drag;
    const HeldSteps& h = body.kind->whole;
    for (int k = 0; k < body.kind->modes; ++k) {
        const double held = body.pushed ? dt * body.modal_force[k] : 0;
        const double mean = h.mean_z[k] * s.q[k] + h.mean_rate[k] * s.q_dot[k] + h.compliance[k] * held;
        s.q_dot[k] = h.c[k] * s.q[k] + h.d[k] * s.q_dot[k] + h.rate[k] * held;
        s.q[k] += dt * mean;
    }
}

bool limit_deformation(MovingBody& body) {
    body.at_limit = false;
    if (body.kind->modes == 0) return false;
    const double bound = body.state.q.cwiseAbs().dot(body.kind->gradient_bound);
    if (!(bound > kGradientLimit) || !std::isfinite(bound)) return false;
    const double largest = largest_gradient(body);
    if (largest <= kGradientLimit) return false;
    Eigen::VectorXd& q = body.state.q;
    Eigen::VectorXd& rate = body.state.q_dot;
    const double outwards = q.dot(rate);
    if (outwards > 0) rate -= outwards / q.squaredNorm() * q;
    q *= kGradientLimit / largest;
    body.at_limit = body.limited_now = true;
    return true;
}

double loose_radius(const BodyKind& kind, const Eigen::VectorXd& q) {
    const double radius = kind.surface.bounding_radius() * (1 + 1e-5);
    if (kind.modes == 0) return radius;
    const double bent = kind.linear() ? kind.gradient_bound.dot(q.cwiseAbs()) * radius
                                      : 1.25 * kind.shape_bound.dot(q.cwiseAbs());
    return radius + bent;
}

double point_speed(const MovingBody& body) noexcept {
    double speed = body.state.velocity.norm() + body.state.angular_momentum.norm() /
                                                    body.kind->mass.inertia.minCoeff() *
                                                    body.kind->surface.bounding_radius();
    for (int k = 0; k < body.kind->modes; ++k)
        speed += std::abs(body.state.q_dot[k]) * body.kind->shape_bound[k];
    return speed;
}

}  // namespace sim
