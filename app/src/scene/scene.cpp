#include "scene/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "files/assets.h"
#include "files/bad_input.h"
#include "files/format_description.h"
#include "files/toml_reader.h"
#include "scene/shared_keys.h"

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kMostBodies = 10000;
constexpr double kLongestS = 360000;  // a hundred hours
constexpr Range kAccuracy{1e-4, 0.5};
constexpr double kDegree = std::numbers::pi / 180;

// What a file says

class SceneReader;

/// A material of a scene, with its damping.
struct SceneMaterial {
    sim::Material material;
    double damping_alpha = 0, damping_beta = 0, damping_ratio = 0.05;
};
using SceneMaterials = std::map<std::string, SceneMaterial>;

/// Copies of a body.
struct BodyGrid {
    std::array<int, 3> count{1, 1, 1};
    Eigen::Vector3d step = Eigen::Vector3d::Zero();
    double jitter_m = 0;
    bool turned = false;
    int seed = 1;
};

struct BodyDraft {
    sim::WorldBody body;
    std::optional<std::string> material;
    std::optional<BodyGrid> grid;
    render::Appearance look;
    std::optional<Eigen::Vector3f> color;
};

struct ConstraintDraft {
    sim::PointConstraint constraint;
    std::string body;
    std::optional<std::string> to;
    std::optional<Eigen::Vector3d> point, to_point, place, at;
};

struct EventDraft {
    std::optional<double> time_s;
    std::optional<std::uint64_t> step;
    std::vector<std::string> removed;
    std::optional<BodyDraft> added;
    std::optional<sim::Slowing> slowing;
    SceneReader* reader = nullptr;
};

// Bodies of a table

/// Colours of bodies that name none: one a kind, or one a copy of a grid.
const std::array<Eigen::Vector3f, 8> kPalette = {Eigen::Vector3f(0.55f, 0.05f, 0.03f),
                                                 {0.62f, 0.25f, 0.02f},
                                                 {0.03f, 0.15f, 0.32f},
                                                 {0.05f, 0.22f, 0.08f},
                                                 Eigen::Vector3f(0.55f, 0.40f, 0.06f),
                                                 {0.20f, 0.06f, 0.22f},
                                                 {0.42f, 0.40f, 0.36f},
                                                 {0.03f, 0.24f, 0.24f}};

/// The named material; without a name the defaults of its keys.
SceneMaterial material_of(const BodyDraft& draft, const SceneMaterials& materials, const Fields& at) {
    if (!draft.material) return {};
    const auto found = materials.find(*draft.material);
    std::string known;
    for (const auto& [name, material] : materials) known += (known.empty() ? "" : ", ") + name;
    at.require(found != materials.end(), "material", fmt::format("material = \"{}\"", *draft.material),
               known.empty() ? "a table [material.NAME] of that name"
                             : fmt::format("one of {} or a table [material.{}]", known, *draft.material));
    return found->second;
}

/// [0, 1), the same on every library.
double uniform(std::mt19937_64& random) {
    return double(random() >> 11) * 0x1p-53;
}

/// Uniform over all orientations (Shoemake 1992).
Eigen::Quaterniond any_turn(std::mt19937_64& random) {
    const double u = uniform(random), a = 2 * std::numbers::pi * uniform(random),
                 b = 2 * std::numbers::pi * uniform(random);
    return {std::sqrt(u) * std::cos(b), std::sqrt(1 - u) * std::sin(a), std::sqrt(1 - u) * std::cos(a),
            std::sqrt(u) * std::sin(b)};
}

/// Centred about the body's own position.
std::vector<sim::WorldBody> copies(const sim::WorldBody& body, const BodyGrid& grid) {
    std::vector<sim::WorldBody> result;
    std::mt19937_64 random(std::uint64_t(grid.seed));
    const auto [nx, ny, nz] = grid.count;
    const Eigen::Vector3d middle = 0.5 * Eigen::Vector3d(nx - 1, 0, nz - 1);
    for (int k = 0; k < nx * ny * nz; ++k) {
        const Eigen::Vector3d at = Eigen::Vector3i(k % nx, k / nx % ny, k / nx / ny).cast<double>();
        sim::WorldBody copy = body;
        copy.name = fmt::format("{}/{}", body.name, k);
        Eigen::Vector3d away;
        for (double& value : away.reshaped()) value = grid.jitter_m * (2 * uniform(random) - 1);
        copy.world_from_body.translation() += grid.step.cwiseProduct(at - middle) + away;
        if (grid.turned) copy.world_from_body.linear() = any_turn(random).toRotationMatrix();
        result.push_back(copy);
    }
    return result;
}

// Bodies, constraints and events of the file

/// Throws BadInput at the key for a name without a number.
int number_of(const std::map<std::string, int>& numbers, const Fields& at, const char* key,
              const std::string& name, const std::string& expected) {
    const auto found = numbers.find(name);
    at.require(found != numbers.end(), key, fmt::format("{} = \"{}\"", key, name), expected);
    return found->second;
}

/// Puts what a file says together: bodies and constraints get numbers, events their order.
class SceneReader {
public:
    Scene scene;
    SceneMaterials materials;
    std::optional<double> dt_s;  ///< stands in for the file's

    void take_body(const Fields& at, const BodyDraft& body) {
        add(body, named(at, body), scene.world.bodies);
    }
    void take_constraint(const Fields& at, const ConstraintDraft& draft) {
        sim::PointConstraint c = draft.constraint;
        if (c.name.empty()) c.name = fmt::format("constraint {}", scene.world.constraints.size());
        const char* expected =
            "the name of a [[body]] that is there from the start (copies of a grid: NAME/0, ...)";
        c.body_a = number_of(bodies_, at, "body", draft.body, expected);
        if (draft.to) c.body_b = number_of(bodies_, at, "to", *draft.to, expected);
        at.require(c.body_a != c.body_b, "to", "a body bound to itself", "another body");
        const auto one_of = [&](bool other, const char* key) {
            at.require(!draft.at || !other, "at", fmt::format("both at and {}", key), "one of them");
        };
        one_of(draft.point.has_value(), "point");
        one_of(draft.to_point.has_value(), "to_point");
        one_of(draft.place.has_value(), "place");
        at.require(!draft.to || !draft.place, "place", "place beside to", "to_point, a point of that body");
        at.require(draft.to || !draft.to_point, "to_point", "to_point without to",
                   "place, a point of the world");
        place_constraint(draft, c);
        at.require(constraints_.try_emplace(c.name, static_cast<int>(constraints_.size())).second, "name",
                   fmt::format("a second constraint \"{}\"", c.name), "a name of its own");
        scene.world.constraints.push_back(c);
    }
    void take_event(const Fields& at, const EventDraft& draft) {
        TimedEvent timed{{}, draft.added, std::move(coming_)};
        at.require(draft.time_s.has_value() != draft.step.has_value(), "time",
                   draft.time_s ? "both time and step" : "neither time nor step", "one of them");
        // The first step that begins at that time or later; a microstep of slack for times that are not exact.
        const double first = std::ceil(draft.time_s.value_or(0) / scene.world.settings.dt - 1e-6);
        timed.event.step = draft.step.value_or(std::uint64_t(std::max(0.0, first)));
        for (const std::string& name : draft.removed)
            timed.event.removed.push_back(
                number_of(constraints_, at, "delete", name, "the name of a [[constraint]]"));
        if (draft.slowing) timed.event.slowing.push_back(*draft.slowing);
        at.require(!draft.removed.empty() || draft.added || draft.slowing, "delete",
                   "an event without effect", "delete, add or slow");
        events_.push_back(std::move(timed));
    }
    void take_added(const Fields& at, const BodyDraft& body) { coming_ = named(at, body); }
    /// After all tables were read. Bodies that come are numbered in the order in which they come.
    void add_events() {
        std::stable_sort(events_.begin(), events_.end(), [](const TimedEvent& a, const TimedEvent& b) {
            return a.event.step < b.event.step;
        });
        for (TimedEvent& timed : events_) {
            timed.event.first = scene.later.size();
            if (timed.added) add(*timed.added, timed.bodies, scene.later);
            timed.event.end = scene.later.size();
            scene.events.push_back(timed.event);
        }
    }

private:
    /// The points are given in the bodies' frames, or both at once by a place in the world (`at`); the second
    /// one's default is where the first is at the start.
    void place_constraint(const ConstraintDraft& draft, sim::PointConstraint& c) const {
        const auto pose = [&](int body) -> const Eigen::Isometry3d& {
            return scene.world.bodies[std::size_t(body)].world_from_body;
        };
        const Eigen::Vector3d point = draft.point.value_or(Eigen::Vector3d::Zero());
        const Eigen::Vector3d start = draft.at.value_or(pose(c.body_a) * point);
        c.point_a = pose(c.body_a).inverse() * start;
        c.point_b = draft.place.value_or(start);
        if (c.body_b >= 0) c.point_b = draft.to_point.value_or(pose(c.body_b).inverse() * c.point_b);
    }
    /// The bodies of a table, under names that no other has: one, or the copies of its `grid`, named NAME/0, NAME/1,
    /// ... (x fastest, then y, then z). The name of its material must be among `materials`, or BadInput is thrown at
    /// the table's place.
    [[nodiscard]] std::vector<sim::WorldBody> named(const Fields& at, const BodyDraft& draft) {
        const SceneMaterial m = material_of(draft, materials, at);
        sim::WorldBody body = draft.body;
        body.material = m.material;
        body.damping_alpha = m.damping_alpha, body.damping_beta = m.damping_beta;
        body.damping_ratio = m.damping_ratio;
        std::vector<sim::WorldBody> bodies = draft.grid ? copies(body, *draft.grid) : std::vector{body};
        for (const sim::WorldBody& each : bodies) {
            const auto number = static_cast<int>(bodies_.size());
            at.require(bodies_.try_emplace(each.name, number).second, "",
                       fmt::format("a second body \"{}\"", each.name), "a name of its own");
        }
        if (bodies_.size() > kMostBodies)
            throw BadInput(fmt::format("{}:1:1: error: found {} bodies and more, expected at most {}",
                                       scene.file.string(), bodies_.size(), kMostBodies));
        return bodies;
    }
    /// Bodies without a colour take one of eight.
    void add(const BodyDraft& draft, const std::vector<sim::WorldBody>& bodies,
             std::vector<sim::WorldBody>& into) {
        BodyLook look{draft.look, kinds_++};
        for (std::size_t k = 0; k < bodies.size(); ++k) {
            into.push_back(bodies[k]);
            look.appearance.color = draft.color.value_or(kPalette[(look.kind + k) % kPalette.size()]);
            scene.looks.push_back(look);
        }
    }

    struct TimedEvent {
        sim::WorldEvent event;
        std::optional<BodyDraft> added;
        std::vector<sim::WorldBody> bodies;  ///< of `added`
    };

    std::map<std::string, int> bodies_, constraints_;
    std::vector<TimedEvent> events_;
    std::vector<sim::WorldBody> coming_;  ///< bodies of the event that is read
    std::size_t kinds_ = 0;
};

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
    keys.require(radius || size, "size", "no key \"size\"", "[3 numbers, each from 0.001 to 100]");
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

void motion_keys(Fields& keys, sim::WorldBody& body) {
    Eigen::Vector3d position(0, 0, 0);
    Eigen::Quaterniond orientation;
    keys.vector("position", position, {-kFarM, kFarM, "m"}, "Of the centre.");
    orientation_keys(keys, orientation);
    body.world_from_body.translation() = position;
    body.world_from_body.linear() = orientation.toRotationMatrix();
    keys.vector("velocity", body.velocity, {-kFarM, kFarM, "m/s"}, "Of the centre.");
    keys.vector("spin", body.angular_velocity, {-kFarM, kFarM, "rad/s"}, "Angular velocity, world axes.");
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
    keys.number("stiffness", draft.constraint.stiffness, {1e-3, 1e12, "N/m"}, "Stiffness of the spring.");
    keys.number("damping_ratio", draft.constraint.damping_ratio, {0, 100},
                "Against the effective mass; 1: critical.");
    keys.number("breaking_force", draft.constraint.breaking_force, {1e-6, 1e15, "N"},
                "Beyond it the constraint goes.", {.otherwise = "never", .example = "1e6"});
}
const TableKind<ConstraintDraft> kConstraint = {
    {"constraint",
     "A damped spring of rest length 0 between a point of a body and a place or a point of another body."},
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

void event_keys(Fields& keys, EventDraft& event) {
    keys.fraction("time", event.time_s, {0, kLongestS, "s"},
                  "Before the first step that begins then or later.",
                  {.otherwise = "`step` is needed", .example = "1"});
    keys.integer("step", event.step, {0, 2e9}, "Before this step, counted from 0.",
                 {.otherwise = "`time` is needed", .example = "30"});
    keys.text_or_texts("delete", event.removed, "A constraint's name, or several.",
                       {.example = "\"string\""});
    keys.table("add", event.added, kBody,
               [&](const Fields& at, const BodyDraft& body) { event.reader->take_added(at, body); });
    keys.table("slow", event.slowing, kSlow);
}
const TableKind<EventDraft> kEvent = {
    {"event",
     "What happens before a step: `time` or `step`, and at least one of `delete`, `add` and `slow`."},
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
