#include "messages/world_scene_codec.h"

#include <cmath>

#include "messages/world_record_codec.h"
#include "sim/errors.h"
#include "world/world_check.h"

namespace sim {
namespace {

//   scene       f64 dt, u32 substeps, v3 gravity, flag sleeping, f64 sleep speed, list of body,
//               list of plane, list of constraint, list of force, list of body (added later), list of event
//   body        text name, v3 semi-axes, f64 e1 e2, list of bump {v3 direction, f64 height width},
//               f64 young poisson density, f64 damping alpha beta ratio,
//               u8 fidelity, i32 modes, i32 elements, u8 domain, f64 error, f64 impact speed,
//               i32 triangles, f64 friction restitution, flag fixed, f64 gravity scale,
//               f64 rotation[9] by columns, v3 translation, v3 velocity, v3 angular velocity,
//               list of key {f64 time, v3 position, f64 orientation: w x y z}
//   plane       v3 normal, f64 offset friction restitution
//   constraint  text name, i32 body a, v3 point a, i32 body b, v3 point b,
//               f64 stiffness damping breaking force (may be infinite),
//               u8 joint, f64 frame of a, of b: w x y z, u8 collide (0 no, 1 yes, 2 by default)
//   force       i32 body, v3 point, v3 force, flag turns, f64 from until
//   event       u64 step, list of i32 constraint, u32 first, u32 end, list of {i32 worker, f64 factor}
//   settings    i32 bound, u64 steps, flag until rest, flag all to first, flag trade, u64 from step,
//               f64 smoothing steps,
//               f64 dead band

constexpr std::uint32_t kLongestName = 65536;
constexpr std::uint8_t kByDefault = 2;
constexpr std::size_t kSmallestBody = 299, kKeyBytes = 64, kPlaneBytes = 48, kSmallestConstraint = 150,
                      kForceBytes = 69, kSmallestEvent = 24, kBumpBytes = 40, kSlowingBytes = 12;

template <typename Enum>
Enum read_enum(ByteReader& in, Enum last) {
    const auto value = in.number<std::uint8_t>();
    if (value > static_cast<std::uint8_t>(last)) throw DecodeError("a choice of " + std::to_string(value));
    return static_cast<Enum>(value);
}

template <typename... Numbers>
void write_all(ByteWriter& out, const Numbers&... numbers) {
    (out.number(numbers), ...);
}

template <typename... Numbers>
void read_all(ByteReader& in, Numbers&... numbers) {
    ((numbers = in.number<Numbers>()), ...);
}

void write(ByteWriter& out, const Eigen::Quaterniond& q) {
    write_all(out, q.w(), q.x(), q.y(), q.z());
}

Eigen::Quaterniond read_quaternion(ByteReader& in) {
    double w = 0, x = 0, y = 0, z = 0;
    read_all(in, w, x, y, z);
    return {w, x, y, z};
}

void write(ByteWriter& out, const FidelityRequest& f) {
    out.number(static_cast<std::uint8_t>(f.fidelity));
    write_all(out, std::int32_t{f.modes}, std::int32_t{f.elements});
    out.number(static_cast<std::uint8_t>(f.domain));
    write_all(out, f.error, f.impact_mps);
}

FidelityRequest read_fidelity(ByteReader& in) {
    FidelityRequest f;
    f.fidelity = read_enum(in, Fidelity::automatic);
    read_all(in, f.modes, f.elements);
    f.domain = read_enum(in, ModeDomain::superquadric);
    read_all(in, f.error, f.impact_mps);
    return f;
}

void write(ByteWriter& out, const GeneralizedSuperquadric& shape) {
    out.matrix(shape.base.semi_axes);
    write_all(out, shape.base.e1, shape.base.e2);
    out.count(shape.bumps.size());
    for (const Bump& bump : shape.bumps) {
        out.matrix(bump.direction);
        write_all(out, bump.height_m, bump.width_rad);
    }
}

GeneralizedSuperquadric read_shape(ByteReader& in) {
    GeneralizedSuperquadric shape;
    in.matrix(shape.base.semi_axes);
    read_all(in, shape.base.e1, shape.base.e2);
    shape.bumps.resize(in.count(kBumpBytes));
    for (Bump& bump : shape.bumps) {
        in.matrix(bump.direction);
        read_all(in, bump.height_m, bump.width_rad);
    }
    return shape;
}

void write(ByteWriter& out, const WorldBody& b) {
    out.text(b.name);
    write(out, b.shape);
    write_all(out, b.material.young_pa, b.material.poisson, b.material.density_kg_m3);
    write_all(out, b.damping_alpha, b.damping_beta, b.damping_ratio);
    write(out, b.fidelity);
    write_all(out, std::int32_t{b.triangles}, b.friction, b.restitution);
    out.number<std::uint8_t>(b.fixed);
    out.number(b.gravity_scale);
    out.matrix(b.world_from_body.linear());
    out.matrix(b.world_from_body.translation());
    out.matrix(b.velocity);
    out.matrix(b.angular_velocity);
    out.count(b.motion.size());
    for (const MotionKey& key : b.motion) {
        out.number(key.time_s);
        out.matrix(key.position);
        write(out, key.orientation);
    }
}

WorldBody read_body(ByteReader& in) {
    WorldBody b;
    b.name = in.text(kLongestName);
    b.shape = read_shape(in);
    read_all(in, b.material.young_pa, b.material.poisson, b.material.density_kg_m3);
    read_all(in, b.damping_alpha, b.damping_beta, b.damping_ratio);
    b.fidelity = read_fidelity(in);
    read_all(in, b.triangles, b.friction, b.restitution);
    b.fixed = in.flag();
    b.gravity_scale = in.number<double>();
    in.matrix(b.world_from_body.linear());
    in.matrix(b.world_from_body.translation());
    in.matrix(b.velocity);
    in.matrix(b.angular_velocity);
    b.motion.resize(in.count(kKeyBytes));
    for (MotionKey& key : b.motion) {
        key.time_s = in.number<double>();
        in.matrix(key.position);
        key.orientation = read_quaternion(in);
    }
    return b;
}

void write(ByteWriter& out, const std::vector<WorldBody>& bodies) {
    out.count(bodies.size());
    for (const WorldBody& body : bodies) write(out, body);
}

std::vector<WorldBody> read_bodies(ByteReader& in) {
    std::vector<WorldBody> bodies(in.count(kSmallestBody));
    for (WorldBody& body : bodies) body = read_body(in);
    return bodies;
}

void write(ByteWriter& out, const std::vector<WorldPlane>& planes) {
    out.count(planes.size());
    for (const WorldPlane& plane : planes) {
        out.matrix(plane.normal);
        write_all(out, plane.offset, plane.friction, plane.restitution);
    }
}

std::vector<WorldPlane> read_planes(ByteReader& in) {
    std::vector<WorldPlane> planes(in.count(kPlaneBytes));
    for (WorldPlane& plane : planes) {
        in.matrix(plane.normal);
        read_all(in, plane.offset, plane.friction, plane.restitution);
    }
    return planes;
}

void write(ByteWriter& out, const std::vector<PointConstraint>& constraints) {
    out.count(constraints.size());
    for (const PointConstraint& c : constraints) {
        out.text(c.name);
        out.number<std::int32_t>(c.body_a);
        out.matrix(c.point_a);
        out.number<std::int32_t>(c.body_b);
        out.matrix(c.point_b);
        write_all(out, c.stiffness, c.damping_ratio, c.breaking_force);
        out.number(static_cast<std::uint8_t>(c.joint));
        write(out, c.frame_a), write(out, c.frame_b);
        out.number(static_cast<std::uint8_t>(c.collide ? *c.collide : kByDefault));
    }
}

std::vector<PointConstraint> read_constraints(ByteReader& in) {
    std::vector<PointConstraint> constraints(in.count(kSmallestConstraint));
    for (PointConstraint& c : constraints) {
        c.name = in.text(kLongestName);
        c.body_a = in.number<std::int32_t>();
        in.matrix(c.point_a);
        c.body_b = in.number<std::int32_t>();
        in.matrix(c.point_b);
        read_all(in, c.stiffness, c.damping_ratio, c.breaking_force);
        c.joint = read_enum(in, Joint::slider);
        c.frame_a = read_quaternion(in), c.frame_b = read_quaternion(in);
        const auto collide = in.number<std::uint8_t>();
        if (collide > kByDefault) throw DecodeError("a choice of " + std::to_string(collide));
        if (collide < kByDefault) c.collide = collide == 1;
    }
    return constraints;
}

void write(ByteWriter& out, const std::vector<TimedForce>& forces) {
    out.count(forces.size());
    for (const TimedForce& f : forces) {
        out.number<std::int32_t>(f.body);
        out.matrix(f.point);
        out.matrix(f.force);
        out.number<std::uint8_t>(f.turns);
        write_all(out, f.from_s, f.until_s);
    }
}

std::vector<TimedForce> read_forces(ByteReader& in) {
    std::vector<TimedForce> forces(in.count(kForceBytes));
    for (TimedForce& f : forces) {
        f.body = in.number<std::int32_t>();
        in.matrix(f.point);
        in.matrix(f.force);
        f.turns = in.flag();
        read_all(in, f.from_s, f.until_s);
    }
    return forces;
}

void write(ByteWriter& out, const WorldEvent& e) {
    out.number(e.step);
    out.count(e.removed.size());
    for (const int constraint : e.removed) out.number<std::int32_t>(constraint);
    out.count(e.first);
    out.count(e.end);
    out.count(e.slowing.size());
    for (const Slowing& s : e.slowing) write_all(out, std::int32_t{s.worker}, s.factor);
}

WorldEvent read_event(ByteReader& in) {
    WorldEvent e;
    e.step = in.number<std::uint64_t>();
    e.removed.resize(in.count(4));
    for (int& constraint : e.removed) constraint = in.number<std::int32_t>();
    e.first = in.number<std::uint32_t>();
    e.end = in.number<std::uint32_t>();
    e.slowing.resize(in.count(kSlowingBytes));
    for (Slowing& s : e.slowing) read_all(in, s.worker, s.factor);
    return e;
}

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

void write(ByteWriter& out, const WorldScene& scene) {
    const WorldSettings& s = scene.world.settings;
    write_all(out, s.dt, static_cast<std::uint32_t>(s.substeps));
    out.matrix(s.gravity);
    out.number<std::uint8_t>(s.sleeping);
    out.number(s.sleep_speed);
    write(out, scene.world.bodies);
    write(out, scene.world.planes);
    write(out, scene.world.constraints);
    write(out, scene.world.forces);
    write(out, scene.later);
    out.count(scene.events.size());
    for (const WorldEvent& event : scene.events) write(out, event);
}

WorldScene read_scene(ByteReader& in) {
    WorldScene scene;
    WorldSettings& s = scene.world.settings;
    read_all(in, s.dt, s.substeps);
    in.matrix(s.gravity);
    s.sleeping = in.flag();
    s.sleep_speed = in.number<double>();
    scene.world.bodies = read_bodies(in);
    scene.world.planes = read_planes(in);
    scene.world.constraints = read_constraints(in);
    scene.world.forces = read_forces(in);
    scene.later = read_bodies(in);
    scene.events.resize(in.count(kSmallestEvent));
    for (WorldEvent& event : scene.events) event = read_event(in);
    check_scene(scene);
    return scene;
}

void write(ByteWriter& out, const DistributedSettings& s) {
    write_all(out, std::int32_t{s.bound}, s.steps, std::uint8_t{s.until_rest}, std::uint8_t{s.all_to_first},
              std::uint8_t{s.market.trade}, s.market.from_step, s.market.smoothing_steps, s.market.dead_band);
}

DistributedSettings read_settings(ByteReader& in) {
    DistributedSettings s;
    read_all(in, s.bound, s.steps);
    s.until_rest = in.flag();
    s.all_to_first = in.flag();
    s.market.trade = in.flag();
    read_all(in, s.market.from_step, s.market.smoothing_steps, s.market.dead_band);
    check_settings(s);
    return s;
}

}  // namespace sim
