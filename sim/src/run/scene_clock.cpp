#include "run/scene_clock.h"

#include <algorithm>

namespace sim {

SceneClock::SceneClock(const WorldScene& scene) {
    scene_.later = scene.later;
    scene_.events = scene.events;
    for (const TimedForce& force : scene.world.forces)
        busy_until_s_ = std::max(busy_until_s_, force.until_s + scene.world.settings.dt);
    for (const auto* bodies : {&scene.world.bodies, &scene.later})
        for (const WorldBody& body : *bodies)
            if (!body.motion.empty()) busy_until_s_ = std::max(busy_until_s_, body.motion.back().time_s);
    busy_ = busy_until_s_ > 0;
    born_.assign(scene.world.bodies.size() + scene.later.size(), 0);
    for (const WorldEvent& event : scene.events)
        for (std::size_t i = event.first; i < event.end; ++i)
            born_[scene.world.bodies.size() + i] = event.step;
    for (const auto* bodies : {&scene.world.bodies, &scene.later})
        for (const WorldBody& body : *bodies) moves_.push_back(body.moves());
    first_later_ = static_cast<int>(scene.world.bodies.size());
}

bool SceneClock::apply(World& world, std::uint64_t step) {
    busy_ = static_cast<double>(step) * world.settings().dt < busy_until_s_;
    const std::size_t before = next_;
    for (; next_ < scene_.events.size() && scene_.events[next_].step <= step; ++next_) {
        const WorldEvent& event = scene_.events[next_];
        for (const int constraint : event.removed)
            if (world.constraint_holds(constraint)) world.remove_constraint(constraint);
        for (std::size_t i = event.first; i < event.end; ++i) (void)world.add_body(scene_.later[i]);
    }
    return next_ > before;
}

bool is_still(const WorldRecord& record, double dt) noexcept {
    return record.asleep || record.still_steps * dt >= 0.5 - 1e-9;
}

}  // namespace sim
