#include "scene/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "files/assets.h"
#include "files/bad_input.h"
#include "files/format_description.h"
#include "files/toml_reader.h"
#include "scene/scene_reader.h"
#include "scene/shared_keys.h"

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr double kLongestS = 360000;  // a hundred hours
constexpr Range kAccuracy{1e-4, 0.5};
constexpr double kDegree = std::numbers::pi / 180;

// Tables within a body

void bump_keys(Fields& keys, sim::Bump& bump) {
    keys.vector("direction", bump.direction, {-kFarM, kFarM},
                "From the centre, body frame, any length but 0.",
                {.need = Need::given, .example = "[0, 1, 0]"});
    keys.require_direction(bump.direction, "direction");
    keys.number("height", bump.height_m, {-25, 100, "m"},
                "Height; negative: a dent. At most 2 times the largest half extent, at least -0.5 times.",
                {.need = Need::given, .example = "0.1"});
    double width_deg = bump.width_rad / kDegree;
    keys.number("width_deg", width_deg, {1, 90, "degrees"}, "Width, in degrees of the body's angle.");
    bump.width_rad = kDegree * width_deg;
}
const TableKind<sim::Bump> kBump = {
    {"bump", "A smooth spike (or dent): height exp(-(angle / width)^2) along the normal."}, bump_keys};

void look_keys(Fields& keys, BodyDraft& body) {
    keys.vector("color", body.color, {0, 1}, "Linear RGB.",
                {.otherwise = "one of eight by turns", .example = "[0.5, 0.1, 0.05]"});
    surface_keys(keys, body.look);
}
const TableKind<BodyDraft> kLook = {{"look", "How it looks."}, look_keys};

void grid_keys(Fields& keys, BodyGrid& grid) {
    Eigen::Vector3d count(1, 1, 1);
    keys.vector("count", count, {1, double(kMostBodies)}, "Copies along x, y, z; 10000 at most in all.",
                {.need = Need::given, .example = "[2, 1, 2]"});
    for (int i = 0; i < 3; ++i) grid.count[std::size_t(i)] = int(count[i]);
    keys.require(count == count.array().floor().matrix() && count.prod() <= double(kMostBodies), "count",
                 "a count that is not whole or too large",
                 fmt::format("[x, y, z] copies, {} at most in all", kMostBodies));
    keys.vector("step", grid.step, {-kFarM, kFarM, "m"}, "Distances between copies.",
                {.need = Need::given, .example = "[1.5, 1.5, 1.5]"});
    keys.number("jitter", grid.jitter_m, {0, kFarM, "m"},
                "Each copy is moved by up to this along each axis, at random.");
    keys.flag("turned", grid.turned, "Each copy is turned at random.");
    keys.integer("seed", grid.seed, {0, 1 << 30}, "Of jitter and turns.");
}
const TableKind<BodyGrid> kGrid = {{"grid",
                                    "Copies of the body, centred about its position in x and z and upwards "
                                    "from it in y, named NAME/0, NAME/1, ... "
                                    "(x fastest, then y, then z)."},
                                   grid_keys};

// [[body]], [defaults] and the body that an event adds

void shape_keys(Fields& keys, sim::GeneralizedSuperquadric& shape) {
    std::optional<double> radius;
    std::optional<Eigen::Vector3d> size;
    Eigen::Vector2d exponents(1, 1);
    keys.number("radius", radius, {0.0005, 50, "m"}, "Of a ball, instead of `size`.",
                {.otherwise = "`size` is needed", .example = "0.5"});
    keys.vector("size", size, {0.001, 100, "m"}, "Full extents along the body's axes; or `radius`.",
                {.otherwise = "`radius` is needed", .example = "[0.4, 0.3, 0.4]"});
    keys.require(!radius || !size, "radius", "both radius and size", "one of them");
    keys.require(radius || size, "size", "no key \"size\"",
                 "[3 numbers, each from 0.001 to 100], or \"radius\" of a ball");
    if (radius) size = Eigen::Vector3d::Constant(2 * *radius);
    if (size) shape.base.semi_axes = 0.5 * *size;
    keys.vector(
        "exponents", exponents, {0.1, 1.9},
        "e1 (profile along y) and e2 (cross-section) of the superquadric: 1 round, towards 0.1 square, "
        "towards 1.9 pinched.");
    shape.base.e1 = exponents[0], shape.base.e2 = exponents[1];
    const double extent = shape.base.semi_axes.maxCoeff();
    keys.tables("bumps", sim::Bump(), kBump, "Spikes and dents.", [&](Fields& at, const sim::Bump& bump) {
        at.require(bump.height_m >= -0.5 * extent && bump.height_m <= 2 * extent, "height",
                   fmt::format("height = {}", bump.height_m), range_text(-0.5 * extent, 2 * extent));
        shape.bumps.push_back(bump);
    });
}

void fidelity_keys(Fields& keys, sim::FidelityRequest& request) {
    keys.choice(
        "fidelity", request.fidelity,
        {{"rigid", sim::Fidelity::rigid},
         {"linear", sim::Fidelity::linear},
         {"modal", sim::Fidelity::modal},
         {"automatic", sim::Fidelity::automatic}},
        "What is computed: rigid; linear: six uniform strains; modal: free vibration modes; automatic: the "
        "cheapest that meets `error`.");
    keys.integer("modes", request.modes, {1, 120},
                 "Free vibration modes of a modal body; at most 75 with elements = 1.");
    keys.integer("elements", request.elements, {1, 4},
                 "27-node bricks per side that the modes are computed with.");
    const int nodes = 2 * request.elements + 1, most = 3 * nodes * nodes * nodes - 6;
    keys.require(request.modes <= most, "modes", fmt::format("modes = {}", request.modes),
                 fmt::format("at most {}, as many as elements = {} has", most, request.elements));
    keys.choice("domain", request.domain,
                {{"superquadric", sim::ModeDomain::superquadric}, {"box", sim::ModeDomain::box}},
                "Matter of the mass and stiffness integrals: the superquadric, or the whole box about it.");
    keys.number("error", request.error, {1e-6, 1},
                "automatic: displacement error allowed, share of the largest extent.");
    keys.number("impact", request.impact_mps, {0.01, 1000, "m/s"}, "automatic: the fastest impact expected.");
}

void motion_key_keys(Fields& keys, sim::MotionKey& key) {
    keys.fraction("time", key.time_s, {0, kLongestS, "s"}, "Since the start.",
                  {.need = Need::given, .example = "1"});
    keys.vector("position", key.position, {-kFarM, kFarM, "m"}, "Of the centre.");
    orientation_keys(keys, key.orientation);
}
const TableKind<sim::MotionKey> kMotionKey = {{"motion",
                                               "Where a body of prescribed motion is at a time; its own "
                                               "`position` and orientation are where it begins."},
                                              motion_key_keys};

void motion_keys(Fields& keys, sim::WorldBody& body) {
    Eigen::Vector3d position(0, 0, 0);
    Eigen::Quaterniond orientation;
    keys.vector("position", position, {-kFarM, kFarM, "m"}, "Of the centre.");
    orientation_keys(keys, orientation);
    body.world_from_body.translation() = position;
    body.world_from_body.linear() = orientation.toRotationMatrix();
    keys.vector("velocity", body.velocity, {-kFarM, kFarM, "m/s"}, "Of the centre.");
    keys.vector("spin", body.angular_velocity, {-kFarM, kFarM, "rad/s"}, "Angular velocity, world axes.");
    keys.tables(
        "motion", sim::MotionKey(), kMotionKey,
        "Prescribed: it goes from key to key at a steady velocity and turn (the shorter way), stays at the "
        "last, and is moved by nothing else; what it meets sees its velocity.",
        [&](Fields& at, const sim::MotionKey& key) {
            const double before = body.motion.empty() ? 0 : body.motion.back().time_s;
            at.require(key.time_s > before, "time", fmt::format("time = {}", key.time_s),
                       fmt::format("a time after {} s, the one before", before));
            body.motion.push_back(key);
        });
}

void body_keys(Fields& keys, BodyDraft& draft) {
    sim::WorldBody& body = draft.body;
    keys.text("name", body.name, "Name, unlike all others.", {.need = Need::here, .example = "\"ball\""});
    shape_keys(keys, body.shape);
    keys.text("material", draft.material, "Name of a [material.NAME].",
              {.otherwise = "a soft one (the defaults of its keys)", .example = "\"soft\""});
    fidelity_keys(keys, body.fidelity);
    keys.integer("triangles", body.triangles, {48, 20000},
                 "Of the surface that is sampled for contact and drawn, at least.");
    keys.number("friction", body.friction, {0, 10}, "Coulomb; of a pair: the root of the product.");
    keys.number("restitution", body.restitution, {0, 1}, "Of a pair: the larger.");
    keys.flag("fixed", body.fixed, "Never moves, does not deform.");
    keys.number("gravity_scale", body.gravity_scale, {-10, 10}, "Factor of gravity.");
    motion_keys(keys, body);
    keys.table("grid", draft.grid, kGrid);
    keys.table("look", draft, kLook);
}
const TableKind<BodyDraft> kBody = {
    {"body", "A body, or the copies of its grid; either `size` or `radius` is needed.", Below::defaults},
    body_keys};

// Other tables of the file

void settings_keys(Fields& keys, Scene& scene) {
    sim::WorldSettings& settings = scene.world.settings;
    keys.fraction("dt", settings.dt, {1e-6, 0.1, "s"}, "Length of a step.");
    keys.integer("substeps", settings.substeps, {1, 100}, "Of each step.");
    keys.vector("gravity", settings.gravity, {-kFarM, kFarM, "m/s^2"}, "Acceleration of free fall.");
    keys.flag("sleeping", settings.sleeping, "Bodies that rest are not computed.");
    keys.number("sleep_speed", settings.sleep_speed, {0, 100, "m/s"},
                "Half a second with all points slower than this: asleep.");
    keys.fraction("seconds", scene.seconds, {1e-3, kLongestS, "s"},
                  "How long `simulate` runs unless told otherwise.");
    keys.number(
        "accuracy", scene.accuracy, kAccuracy,
        "Error allowed against the continuum, share of each body's largest extent: chooses what is computed "
        "of automatic bodies, their samples, and parts of `dt`.",
        {.otherwise = "all as the file says", .example = "0.01"});
}
const TableKind<Scene> kSettings = {{"settings", "How it is computed."}, settings_keys};

void workers_keys(Fields& keys, SceneWorkers& workers) {
    keys.flag("all_to_first", workers.all_to_first,
              "At first one worker owns every body; else each gets neighbours, in equal numbers.");
    keys.integer("balance_from", workers.balance_from, {0, 2e9, "steps"},
                 "Workers trade bodies from this step on.");
}
const TableKind<SceneWorkers> kWorkers = {{"workers", "With several workers: how they begin."}, workers_keys};

void damped_material_keys(Fields& keys, SceneMaterial& m) {
    material_keys(keys, m.material);
    keys.number("damping_alpha", m.damping_alpha, {0, 1e6, "1/s"},
                "Damping of modes in proportion to mass: C = alpha M + beta K.");
    keys.number("damping_beta", m.damping_beta, {0, 1e3, "s"},
                "Damping of modes in proportion to stiffness.");
    keys.number("damping_ratio", m.damping_ratio, {0, 10},
                "Damping ratio of every mode, added to the above.");
}
const TableKind<SceneMaterial> kMaterial = {{"material", "What a body is made of, and its damping."},
                                            damped_material_keys};

void surface_contact_keys(Fields& keys, sim::WorldPlane& plane) {
    keys.number("friction", plane.friction, {0, 10}, "Coulomb.");
    keys.number("restitution", plane.restitution, {0, 1}, "Restitution.");
}

void plane_keys(Fields& keys, sim::WorldPlane& plane) {
    keys.vector("normal", plane.normal, {-kFarM, kFarM}, "Away from the solid, any length but 0.");
    keys.require_direction(plane.normal, "normal");
    plane.normal.normalize();
    keys.number("offset", plane.offset, {-kFarM, kFarM, "m"}, "Along the unit normal.");
    surface_contact_keys(keys, plane);
}
const TableKind<sim::WorldPlane> kPlane = {{"plane", "A half-space normal . x <= offset that is solid."},
                                           plane_keys};

struct BoxDraft {
    SceneBox box{{0, 0}, {0, 0}, 0};
    sim::WorldPlane plane;
};
void box_keys(Fields& keys, BoxDraft& draft) {
    keys.vector("size", draft.box.size, {1e-3, 2 * kFarM, "m"}, "Inner extents along x and z.",
                {.need = Need::given, .example = "[6, 6]"});
    keys.vector("center", draft.box.center, {-kFarM, kFarM, "m"}, "x and z of its middle.");
    keys.number("floor", draft.box.floor, {-kFarM, kFarM, "m"}, "Height of the floor.");
    surface_contact_keys(keys, draft.plane);
}
const TableKind<BoxDraft> kBox = {{"box", "A floor and four walls, drawn as kerbs."}, box_keys};

void constraint_keys(Fields& keys, ConstraintDraft& draft) {
    const Range anywhere{-kFarM, kFarM, "m"};
    keys.text("name", draft.constraint.name, "For events.",
              {.otherwise = "constraint N, counted from 0", .example = "\"string\""});
    keys.choice("type", draft.constraint.joint,
                {{"ball", sim::Joint::ball}, {"hinge", sim::Joint::hinge}, {"slider", sim::Joint::slider}},
                "What it leaves free: ball: all turns about the point; hinge: turns about the axis; slider: "
                "sliding along the axis, without turning. There are no limits and no motors.");
    keys.vector("axis", draft.axis, anywhere, "In the world at the start, any length but 0.",
                {.otherwise = "a hinge and a slider need it", .example = "[0, 1, 0]"});
    if (draft.axis) keys.require_direction(*draft.axis, "axis");
    keys.text("body", draft.body, "The body.", {.need = Need::given, .example = "\"ball\""});
    keys.text("to", draft.to, "Another body; without: the constraint holds the point at a place.",
              {.example = "\"other\""});
    keys.vector("point", draft.point, anywhere, "Of the body, in its frame at rest.",
                {.otherwise = "its centre", .example = "[0, 0.1, 0]"});
    keys.vector("at", draft.at, anywhere,
                "In the world at the start, for both sides, instead of point, to_point and place.",
                {.example = "[0, 1, 0]"});
    keys.vector("place", draft.place, anywhere, "In the world.",
                {.otherwise = "where the point is at the start", .example = "[0, 2, 0]"});
    keys.vector("to_point", draft.to_point, anywhere, "Of the other body.",
                {.otherwise = "where the point is at the start", .example = "[0, 0, 0]"});
    keys.number(
        "stiffness", draft.stiffness, {1e-3, kRigid, "N/m"},
        "Of the spring; of each of a hinge's or slider's two points, half the smaller body's extent from "
        "the point. 1e12: rigid.",
        {.otherwise = "1e4; of a hinge or slider 1e12", .example = "1e6"});
    keys.number("damping_ratio", draft.constraint.damping_ratio, {0, 100},
                "Against the effective mass; 1: critical.");
    keys.number("breaking_force", draft.constraint.breaking_force, {1e-6, 1e15, "N"},
                "Beyond it, at any of its points, the constraint goes.",
                {.otherwise = "never", .example = "1e6"});
    keys.flag(
        "collide", draft.constraint.collide, "Whether the two bodies collide.",
        {.otherwise = "unless the point lies within both, their surfaces included", .example = "false"});
}
const TableKind<ConstraintDraft> kConstraint = {{"constraint",
                                                 "A damped spring of rest length 0 between a point of a body "
                                                 "and a place or a point of another body; or a hinge "
                                                 "or slider."},
                                                constraint_keys};

void slow_keys(Fields& keys, sim::Slowing& slowing) {
    keys.integer("worker", slowing.worker, {0, 1000}, "Its number, from 0.",
                 {.need = Need::given, .example = "1"});
    keys.number("factor", slowing.factor, {1, 1e6}, "Times longer.", {.need = Need::given, .example = "3"});
}
const TableKind<sim::Slowing> kSlow = {{"slow",
                                        "In a simulation on several processes a worker takes longer for each "
                                        "step; in one process this has no effect "
                                        "and a note says so."},
                                       slow_keys};

void push_keys(Fields& keys, PushDraft& push) {
    const Range strength{-1e12, 1e12, "N"};
    keys.text("body", push.body, "The body.", {.need = Need::given, .example = "\"ball\""});
    keys.vector("point", push.timed.point, {-kFarM, kFarM, "m"}, "Where, in the body's frame at rest.");
    keys.vector("force", push.force, strength, "A constant force, for `seconds`.",
                {.otherwise = "`impulse` is needed", .example = "[0, 10, 0]"});
    keys.fraction("seconds", push.seconds, {1e-6, kLongestS, "s"}, "How long the force acts.",
                  {.otherwise = "a force needs it", .example = "0.5"});
    keys.vector("impulse", push.impulse, {-1e12, 1e12, "N s"},
                "An impulse, within the substep in which `time` falls.",
                {.otherwise = "`force` is needed", .example = "[0, 10, 0]"});
    keys.choice("axes", push.timed.turns, {{"world", false}, {"body", true}},
                "In which the vector is given; those of the body turn with it.");
}
const TableKind<PushDraft> kPush = {{"push", "A force on a body from the event's time on, or an impulse."},
                                    push_keys};

void event_keys(Fields& keys, EventDraft& event) {
    keys.fraction("time", event.time_s, {0, kLongestS, "s"},
                  "Before the first step that begins then or later; a push acts from this time on.",
                  {.otherwise = "`step` is needed", .example = "1"});
    keys.integer("step", event.step, {0, 2e9}, "Before this step, counted from 0.",
                 {.otherwise = "`time` is needed", .example = "30"});
    keys.text_or_texts("delete", event.removed, "A constraint's name, or several.",
                       {.example = "\"string\""});
    keys.table("add", event.added, kBody,
               [&](const Fields& at, const BodyDraft& body) { event.reader->take_added(at, event, body); });
    keys.table("push", event.push, kPush);
    keys.table("slow", event.slowing, kSlow);
}
const TableKind<EventDraft> kEvent = {
    {"event",
     "What happens before a step: `time` or `step`, and at least one of `delete`, `add`, `push` and `slow`."},
    event_keys};

void scene_room_keys(Fields& keys, Scene& scene) {
    room_keys(keys, scene.room);
    keys.number("scale", scene.drawn_scale, {1e-3, 1e3},
                "Everything is drawn this much larger: the room is a few metres wide.");
}
const TableKind<Scene> kRoom = {
    {"room", "The floor and the wall behind, for the eye alone: bodies meet only `plane` and `box`."},
    scene_room_keys};

// The file

/// A floor and four walls, looking inwards.
void add_box(Scene& scene, const BoxDraft& draft) {
    scene.box = draft.box;
    const auto add = [&](const Eigen::Vector3d& normal, double offset) {
        scene.world.planes.push_back(draft.plane);
        scene.world.planes.back().normal = normal, scene.world.planes.back().offset = offset;
    };
    add(Eigen::Vector3d::UnitY(), draft.box.floor);
    for (const int side : {0, 1}) {
        const Eigen::Vector3d normal = side == 0 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitZ();
        add(normal, draft.box.center[side] - 0.5 * draft.box.size[side]);
        add(-normal, -draft.box.center[side] - 0.5 * draft.box.size[side]);
    }
}

void plane_tables(Fields& keys, Scene& scene) {
    keys.tables("plane", sim::WorldPlane(), kPlane, "Solid half-spaces.",
                [&](Fields&, const sim::WorldPlane& plane) { scene.world.planes.push_back(plane); });
    std::optional<BoxDraft> box;
    keys.table("box", box, kBox);
    if (box) add_box(scene, *box);
}

void scene_keys(Fields& keys, SceneReader& reader) {
    Scene& scene = reader.scene;
    keys.text("name", scene.name, "Name of the scene.",
              {.otherwise = "the file's", .example = "\"Two balls\""});
    keys.text("description", scene.description, "One line about it.");
    keys.table("settings", scene, kSettings);
    if (reader.dt_s) scene.world.settings.dt = *reader.dt_s;
    keys.table("workers", scene.workers, kWorkers);
    keys.named_tables("material", reader.materials, kMaterial, "Materials by name.");
    keys.partial_table("defaults", kBody);
    keys.tables("body", BodyDraft(), kBody, "Bodies, at least one.",
                [&](const Fields& at, const BodyDraft& body) { reader.take_body(at, body); });
    keys.tables("constraint", ConstraintDraft(), kConstraint, "Constraints.",
                [&](const Fields& at, const ConstraintDraft& c) { reader.take_constraint(at, c); });
    plane_tables(keys, scene);
    keys.table("camera", scene.camera, kCamera);
    keys.table("room", scene, kRoom);
    EventDraft event;
    event.reader = &reader;
    keys.tables("event", event, kEvent, "Timed events.",
                [&](const Fields& at, const EventDraft& e) { reader.take_event(at, e); });
}

const TableKind<SceneReader> kSceneFile = {
    {"scene", "A scene file (TOML) for `musicworld simulate`. SI units, y up, right-handed."}, scene_keys};

}  // namespace

fs::path find_scene(const std::string& name_or_path) {
    return find_bundled(name_or_path, "scenes");
}

Scene read_scene(const fs::path& file, std::optional<double> dt_s) {
    SceneReader reader;
    reader.scene.file = file;
    reader.scene.name = file.stem().string();
    reader.dt_s = dt_s;
    read_toml({TomlFile("a scene", file)}, "the scene", [&](Fields& keys) { kSceneFile.keys(keys, reader); });
    reader.add_events();
    if (reader.scene.world.bodies.empty())
        throw BadInput(fmt::format("{}:1:1: error: found no [[body]], expected at least one", file.string()));
    return std::move(reader.scene);
}

FormatDescription scene_format() {
    return describe_format(kSceneFile);
}

}  // namespace app
