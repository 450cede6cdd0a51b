#pragma once
#include "messages/body_fields.h"
#include "sim/distributed_world.h"

namespace sim {

// What a worker is given when it joins. Reading throws DecodeError or std::invalid_argument.

/// Throws std::invalid_argument: what was found, what was expected.
void check_scene(const WorldScene& scene);
void check_settings(const DistributedSettings& settings);

constexpr std::uint32_t kLongestName = 65536;

void fields(auto& archive, Is<FidelityRequest> auto& f) {
    archive("fidelity modes elements domain error impact_mps", Choice{f.fidelity, Fidelity::automatic},
            f.modes, f.elements, Choice{f.domain, ModeDomain::superquadric}, f.error, f.impact_mps);
}
void fields(auto& archive, Is<Bump> auto& b) {
    archive("direction height_m width_rad", b.direction, b.height_m, b.width_rad);
}
void fields(auto& archive, Is<GeneralizedSuperquadric> auto& shape) {
    archive("base bumps", shape.base, shape.bumps);
}
void fields(auto& archive, Is<MotionKey> auto& key) {
    archive("time_s position orientation", key.time_s, key.position, key.orientation);
}
void fields(auto& archive, Is<WorldBody> auto& b) {
    archive("name shape material", Text{b.name, kLongestName}, b.shape, b.material);
    archive("damping_alpha damping_beta damping_ratio fidelity", b.damping_alpha, b.damping_beta,
            b.damping_ratio, b.fidelity);
    archive("triangles friction restitution fixed gravity_scale", b.triangles, b.friction, b.restitution,
            b.fixed, b.gravity_scale);
    archive("world_from_body velocity angular_velocity motion", b.world_from_body, b.velocity,
            b.angular_velocity, b.motion);
}
void fields(auto& archive, Is<WorldPlane> auto& p) {
    archive("normal offset friction restitution", p.normal, p.offset, p.friction, p.restitution);
}
template <typename Archive>
void fields(Archive& archive, Is<PointConstraint> auto& c) {
    constexpr std::uint8_t kByDefault = 2;
    std::uint8_t collide = c.collide ? *c.collide : kByDefault;
    archive("name body_a point_a body_b point_b", Text{c.name, kLongestName}, c.body_a, c.point_a, c.body_b,
            c.point_b);
    archive("stiffness damping_ratio breaking_force joint", c.stiffness, c.damping_ratio, c.breaking_force,
            Choice{c.joint, Joint::slider});
    archive("frame_a frame_b collide", c.frame_a, c.frame_b, Within{collide, 0, kByDefault});
    if constexpr (Archive::kReads)
        c.collide = collide < kByDefault ? std::optional(collide == 1) : std::nullopt;
}
void fields(auto& archive, Is<TimedForce> auto& f) {
    archive("body point force turns from_s until_s", f.body, f.point, f.force, f.turns, f.from_s, f.until_s);
}
void fields(auto& archive, Is<Slowing> auto& s) {
    archive("worker factor", s.worker, s.factor);
}
void fields(auto& archive, Is<WorldEvent> auto& e) {
    archive("step removed first end slowing", e.step, e.removed, Count{e.first}, Count{e.end}, e.slowing);
}
void fields(auto& archive, Is<WorldSettings> auto& s) {
    archive("dt substeps gravity sleeping sleep_speed", s.dt, s.substeps, s.gravity, s.sleeping,
            s.sleep_speed);
}
void fields(auto& archive, Is<WorldDefinition> auto& w) {
    archive("settings bodies planes constraints forces", w.settings, w.bodies, w.planes, w.constraints,
            w.forces);
}
template <typename Archive>
void fields(Archive& archive, Is<WorldScene> auto& scene) {
    archive("world later events", scene.world, scene.later, scene.events);
    if constexpr (Archive::kReads) check_scene(scene);
}
void fields(auto& archive, Is<MarketSettings> auto& m) {
    archive("trade from_step smoothing_steps dead_band", m.trade, m.from_step, m.smoothing_steps,
            m.dead_band);
}
template <typename Archive>
void fields(Archive& archive, Is<DistributedSettings> auto& s) {
    archive("bound steps until_rest all_to_first market", s.bound, s.steps, s.until_rest, s.all_to_first,
            s.market);
    if constexpr (Archive::kReads) check_settings(s);
}

}  // namespace sim
