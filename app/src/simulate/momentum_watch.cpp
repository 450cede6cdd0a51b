#include "simulate/momentum_watch.h"

#include <algorithm>

namespace app {

MomentumWatch::MomentumWatch(const sim::WorldScene& scene, const sim::World& world) : scene_(scene) {
    closed_ = scene.world.planes.empty() && scene.events.empty();
    for (const sim::PointConstraint& c : scene.world.constraints) closed_ = closed_ && c.body_b >= 0;
    for (int body = 0; closed_ && body < world.bodies(); ++body) {
        const sim::WorldBody& definition = world.definition(body);
        closed_ = !definition.fixed && definition.damping_alpha == 0;
        weight_ += world.rigid_mass(body).mass * definition.gravity_scale * scene.world.settings.gravity;
    }
    momentum_ = world.momentum(), angular_momentum_ = world.angular_momentum();
    look(world);
}

void MomentumWatch::look(const sim::World& world) {
    double sum = 0;
    for (int body = 0; body < world.bodies(); ++body)
        if (!world.definition(body).fixed)
            sum += world.rigid_mass(body).mass * world.state(body).velocity.norm();
    scale_ = std::max(scale_, sum);
    gained_ = world.momentum() - momentum_ - brought(world);
    if (!closed_) return;
    linear_ = std::max(linear_, (gained_ - weight_ * world.time_s()).norm());
    if (weight_.isZero())
        angular_ = std::max(angular_, (world.angular_momentum() - angular_momentum_).norm());
}

/// Momentum of bodies that came later, as they came.
Eigen::Vector3d MomentumWatch::brought(const sim::World& world) const {
    Eigen::Vector3d sum(0, 0, 0);
    for (int body = static_cast<int>(scene_.world.bodies.size()); body < world.bodies(); ++body)
        if (!world.definition(body).fixed)
            sum += world.rigid_mass(body).mass * world.definition(body).velocity;
    return sum;
}

std::optional<MomentumDrift> MomentumWatch::drift(const std::optional<Eigen::Vector3d>& outside) const {
    if (closed_)
        return MomentumDrift{linear_, weight_.isZero() ? std::optional(angular_) : std::nullopt, scale_};
    if (!outside) return {};
    return MomentumDrift{(gained_ - *outside).norm(), {}, scale_};
}

}  // namespace app
