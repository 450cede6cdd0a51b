#include "accuracy/load_watch.h"

#include <algorithm>

#include "contact/manifold.h"

namespace sim {

void LoadWatch::press(const World& world, int body, const Eigen::Vector3d& arm, double force) {
    const auto b = static_cast<std::size_t>(body);
    const ContactCompliance* kind = (*kinds_)[b];
    if (kind == nullptr) return;
    const Eigen::Vector3d at = world.state(body).orientation.conjugate() * arm;
    if (Touch& touch = touches_[b]; !touch.any || force > touch.force) touch = {true, force, at};
    now_[b][std::size_t(kind->place_at(at))] += force;
}

// What hit a body in this step, if it was touched.
void LoadWatch::hit(const World& world, int body) {
    const auto b = static_cast<std::size_t>(body);
    const WorldSettings& settings = world.settings();
    const WorldBody& definition = world.definition(body);
    const Eigen::Vector3d change = world.state(body).velocity - velocities_[b];
    const Eigen::Vector3d forced = change - settings.dt * definition.gravity_scale * settings.gravity;
    const double speed = std::min(change.norm(), forced.norm()) / (1 + definition.restitution);
    const ContactCompliance& kind = *(*kinds_)[b];
    PlaceLoad& most = loads_[b][std::size_t(kind.place_at(touches_[b].at))];
    if (speed <= most.load.speed) return;
    most.load.speed = speed, most.load.radius = kind.radius_at(touches_[b].at);
    most.speed_s = world.time_s();
}

void LoadWatch::at(const World& world) {
    const auto bodies = static_cast<std::size_t>(world.bodies());
    const std::size_t known = velocities_.size();
    loads_.resize(kinds_->size()), velocities_.resize(bodies);
    now_.assign(bodies, {}), before_.resize(bodies), touches_.assign(bodies, {});
    const WorldSettings& settings = world.settings();
    for (const ContactRecord& c : world.snapshot().contacts) {
        double impulse = 0;
        Eigen::Vector3d weighted = Eigen::Vector3d::Zero(), middle = Eigen::Vector3d::Zero();
        for (int p = 0; p < c.count; ++p) {
            const Eigen::Vector3d arm = c.points[p].arm_a.cast<double>();
            impulse += c.points[p].normal_impulse;
            weighted += c.points[p].normal_impulse * arm, middle += arm / c.count;
        }
        // Without impulse it may have touched in earlier substeps.
        const Eigen::Vector3d arm = impulse > 0 ? Eigen::Vector3d(weighted / impulse) : middle;
        const double force = impulse * settings.substeps / settings.dt;
        press(world, c.a, arm, force);
        if (c.b < kFirstPlane)
            press(world, c.b, arm + world.state(c.a).position - world.state(c.b).position, force);
    }
    for (std::size_t b = 0; b < bodies; ++b) {
        for (std::size_t p = 0; p < kContactPlaces; ++p) {
            const double lasting = std::min(now_[b][p], before_[b][p]);
            PlaceLoad& most = loads_[b][p];
            if (lasting > most.load.force) most.load.force = lasting, most.force_s = world.time_s();
        }
        if (touches_[b].any && b < known) hit(world, static_cast<int>(b));
        velocities_[b] = world.state(static_cast<int>(b)).velocity;
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
                most.load.speed = other.load.speed, most.load.radius = other.load.radius,
                most.speed_s = other.speed_s;
            if (other.load.force > most.load.force)
                most.load.force = other.load.force, most.force_s = other.force_s;
        }
}

}  // namespace sim
