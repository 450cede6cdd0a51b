#include "shared/load_watch.h"

#include <algorithm>

#include "world/manifold.h"

namespace sim {

void LoadWatch::press(const World& world, int body, const Eigen::Vector3d& arm, double force) {
    const auto b = static_cast<std::size_t>(body);
    const ContactCompliance* kind = (*kinds_)[b];
    if (kind == nullptr) return;
    const Eigen::Vector3d at = world.state(body).orientation.conjugate() * arm;
    now_[b][std::size_t(kind->place_at(at))] += force;
}

void LoadWatch::at(const World& world) {
    const auto bodies = static_cast<std::size_t>(world.bodies());
    const std::size_t known = velocities_.size();
    loads_.resize(kinds_->size()), velocities_.resize(bodies);
    now_.assign(bodies, {}), before_.resize(bodies), touched_.assign(bodies, false);
    world.contact_records(contacts_);
    const WorldSettings& settings = world.settings();
    for (const ContactRecord& c : contacts_) {
        double force = 0;
        Eigen::Vector3d arm = Eigen::Vector3d::Zero();
        for (int p = 0; p < c.count; ++p) {
            force += c.points[p].normal_impulse;
            arm += c.points[p].normal_impulse * c.points[p].arm_a.cast<double>();
        }
        touched_[std::size_t(c.a)] = true;  // perhaps in earlier substeps alone
        if (c.b < kFirstPlane) touched_[std::size_t(c.b)] = true;
        if (force <= 0) continue;
        arm /= force;
        force *= settings.substeps / settings.dt;
        press(world, c.a, arm, force);
        if (c.b < kFirstPlane)
            press(world, c.b, arm + world.state(c.a).position - world.state(c.b).position, force);
    }
    for (std::size_t b = 0; b < bodies; ++b) {
        const WorldBodyState state = world.state(static_cast<int>(b));
        const WorldBody& body = world.definition(static_cast<int>(b));
        const ContactCompliance* kind = (*kinds_)[b];
        for (std::size_t p = 0; kind != nullptr && p < kContactPlaces; ++p) {
            const double lasting = std::min(now_[b][p], before_[b][p]);
            PlaceLoad& most = loads_[b][p];
            if (lasting > most.load.force) most.load.force = lasting, most.force_s = world.time_s();
        }
        if (kind != nullptr && touched_[b] && b < known) {
            const Eigen::Vector3d change = state.velocity - velocities_[b];
            const Eigen::Vector3d forced = change - settings.dt * body.gravity_scale * settings.gravity;
            const double speed = std::min(change.norm(), forced.norm()) / (1 + body.restitution);
            PlaceLoad& most = loads_[b][std::size_t(kind->place_of(state.orientation.conjugate() * -forced))];
            if (speed > most.load.speed) most.load.speed = speed, most.speed_s = world.time_s();
        }
        velocities_[b] = state.velocity;
    }
    before_.swap(now_);
}

void join_loads(const std::vector<BodyLoads>& others, std::vector<BodyLoads>& loads) {
    loads.resize(std::max(loads.size(), others.size()));
    for (std::size_t b = 0; b < others.size(); ++b)
        for (std::size_t p = 0; p < kContactPlaces; ++p) {
            const PlaceLoad& other = others[b][p];
            PlaceLoad& most = loads[b][p];
            if (other.load.speed > most.load.speed)
                most.load.speed = other.load.speed, most.speed_s = other.speed_s;
            if (other.load.force > most.load.force)
                most.load.force = other.load.force, most.force_s = other.force_s;
        }
}

}  // namespace sim
