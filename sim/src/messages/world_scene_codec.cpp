#include "messages/world_scene_codec.h"

#include "messages/world_record_codec.h"
#include "sim/errors.h"
#include "world/world_check.h"

namespace sim {
namespace {

[[noreturn]] void refuse(const std::string& what, const std::string& found, const std::string& expected) {
    throw InputError(what, found, expected);
}

void check_event(const WorldScene& scene, const WorldEvent& e) {
    const auto constraints = static_cast<int>(scene.world.constraints.size());
    for (const int c : e.removed)
        if (c < 0 || c >= constraints) refuse("event", "constraint " + std::to_string(c), "one of the scene");
    if (e.first > e.end || e.end > scene.later.size())
        refuse("event", "later bodies " + std::to_string(e.first) + " to " + std::to_string(e.end),
               "at most " + std::to_string(scene.later.size()));
    for (const Slowing& s : e.slowing)
        if (s.worker < 0 || !(s.factor >= 1e-6 && s.factor <= 1e6))
            refuse("event", "a slowing by " + std::to_string(s.factor), "a worker, and 1e-6 to 1e6");
}

}  // namespace

void check_scene(const WorldScene& scene) {
    check_world(scene.world);
    for (const WorldBody& body : scene.world.bodies) check_world_body(body);
    for (const WorldBody& body : scene.later) check_world_body(body);
    const auto bodies = static_cast<int>(scene.world.bodies.size());
    for (const PointConstraint& c : scene.world.constraints) check_constraint(c, bodies);
    std::uint64_t last = 0;
    for (const WorldEvent& e : scene.events) {
        check_event(scene, e);
        if (e.step < last) refuse("event", "step " + std::to_string(e.step), "ascending steps");
        last = e.step;
    }
    const std::size_t all = scene.world.bodies.size() + scene.later.size();
    for (const TimedForce& force : scene.world.forces)
        if (force.body >= static_cast<int>(all))
            refuse("force", "body " + std::to_string(force.body), "one of the scene");
    if (all > kMostWorldBodies) refuse("scene", std::to_string(all) + " bodies", "at most 2^24");
}

void check_settings(const DistributedSettings& s) {
    if (s.bound < 0 || s.bound > 1000000) refuse("bound", std::to_string(s.bound), "0 to 1000000 steps");
    const double smoothing = s.market.smoothing_steps, band = s.market.dead_band;
    if (!(smoothing > 0 && smoothing <= 1e6))
        refuse("smoothing of the market", std::to_string(smoothing), "above 0, to 1e6 steps");
    if (!(band >= 0 && band <= 1e6)) refuse("dead band of the market", std::to_string(band), "0 to 1e6");
}

}  // namespace sim
