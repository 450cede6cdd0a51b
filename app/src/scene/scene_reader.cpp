#include "scene/scene_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "files/bad_input.h"

namespace app {
namespace {

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

}  // namespace

void SceneReader::take_body(const Fields& at, const BodyDraft& body) {
    add(body, named(at, body, 0), scene.world.bodies);
}

void SceneReader::take_constraint(const Fields& at, const ConstraintDraft& draft) {
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
    at.require(draft.to || !draft.to_point, "to_point", "to_point without to", "place, a point of the world");
    const bool ball = c.joint == sim::Joint::ball;
    at.require(ball || draft.axis, "axis", "no key \"axis\"", "the axis of the hinge or slider, [x, y, z]");
    at.require(!ball || !draft.axis, "axis", "the axis of a ball", "type = \"hinge\" or \"slider\"");
    if (!ball || draft.stiffness) c.stiffness = draft.stiffness.value_or(kRigid);
    if (c.stiffness >= kRigid) c.stiffness = std::numeric_limits<double>::infinity();
    place_constraint(draft, c);
    at.require(constraints_.try_emplace(c.name, static_cast<int>(constraints_.size())).second, "name",
               fmt::format("a second constraint \"{}\"", c.name), "a name of its own");
    scene.world.constraints.push_back(c);
}

void SceneReader::take_event(const Fields& at, const EventDraft& draft) {
    TimedEvent timed{{}, draft.added, std::move(coming_)};
    at.require(draft.time_s.has_value() != draft.step.has_value(), "time",
               draft.time_s ? "both time and step" : "neither time nor step", "one of them");
    timed.event.step = step_of(draft);
    for (const std::string& name : draft.removed)
        timed.event.removed.push_back(
            number_of(constraints_, at, "delete", name, "the name of a [[constraint]]"));
    if (draft.slowing) timed.event.slowing.push_back(*draft.slowing);
    if (draft.push) pushed_.push_back({this->timed(at, draft), draft.push->body});
    at.require(!draft.removed.empty() || draft.added || draft.slowing || draft.push, "delete",
               "an event without effect", "delete, add, push or slow");
    // A push is no event of the world's: it has a time of its own.
    if (draft.push && draft.removed.empty() && !draft.added && !draft.slowing) return;
    events_.push_back(std::move(timed));
}

// The first step that begins at its time or later; a microstep of slack for times that are not exact.
std::uint64_t SceneReader::step_of(const EventDraft& event) const {
    const double first = std::ceil(event.time_s.value_or(0) / scene.world.settings.dt - 1e-6);
    return event.step.value_or(std::uint64_t(std::max(0.0, first)));
}

sim::TimedForce SceneReader::timed(const Fields& at, const EventDraft& event) const {
    const PushDraft& push = *event.push;
    const std::string in = "push";
    const auto found = bodies_.find(push.body);
    at.require(found != bodies_.end(), in, fmt::format("body = \"{}\"", push.body),
               "the name of a [[body]], or of one that an event before adds");
    const auto body = std::size_t(found->second);
    at.require(body >= scene.world.bodies.size() || scene.world.bodies[body].moves(), in,
               fmt::format("body = \"{}\", which is fixed or has a motion", push.body),
               "a body that forces move");
    at.require(push.force.has_value() != push.impulse.has_value(), in,
               push.force ? "both force and impulse" : "neither force nor impulse", "one of them");
    at.require(push.force.has_value() == push.seconds.has_value(), in,
               push.force ? "a force without seconds" : "an impulse with seconds",
               push.force ? "seconds, how long it acts" : "an impulse without");
    sim::TimedForce timed = push.timed;
    timed.force = push.force ? *push.force : *push.impulse;
    timed.from_s = event.time_s.value_or(double(step_of(event)) * scene.world.settings.dt);
    timed.until_s = timed.from_s + push.seconds.value_or(0);
    return timed;
}

void SceneReader::take_added(const Fields& at, const EventDraft& event, const BodyDraft& body) {
    coming_ = named(at, body, double(step_of(event)) * scene.world.settings.dt);
}

void SceneReader::add_events() {
    std::stable_sort(events_.begin(), events_.end(),
                     [](const TimedEvent& a, const TimedEvent& b) { return a.event.step < b.event.step; });
    for (TimedEvent& timed : events_) {
        timed.event.first = scene.later.size();
        if (timed.added) add(*timed.added, timed.bodies, scene.later);
        timed.event.end = scene.later.size();
        scene.events.push_back(timed.event);
    }
    std::map<std::string, int> numbers;
    for (const auto* bodies : {&scene.world.bodies, &scene.later})
        for (const sim::WorldBody& body : *bodies)
            numbers.emplace(body.name, static_cast<int>(numbers.size()));
    for (Pushed& pushed : pushed_) {
        pushed.force.body = numbers.at(pushed.body);
        scene.world.forces.push_back(pushed.force);
    }
}

/// The points are given in the bodies' frames, or both at once by a place in the world (`at`); the second
/// one's default is where the first is at the start.

void SceneReader::place_constraint(const ConstraintDraft& draft, sim::PointConstraint& c) const {
    const auto pose = [&](int body) -> const Eigen::Isometry3d& {
        return scene.world.bodies[std::size_t(body)].world_from_body;
    };
    const Eigen::Vector3d point = draft.point.value_or(Eigen::Vector3d::Zero());
    const Eigen::Vector3d start = draft.at.value_or(pose(c.body_a) * point);
    c.point_a = pose(c.body_a).inverse() * start;
    c.point_b = draft.place.value_or(start);
    if (c.body_b >= 0) c.point_b = draft.to_point.value_or(pose(c.body_b).inverse() * c.point_b);
    if (!draft.axis) return;
    const auto frame = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), *draft.axis);
    const auto in = [&](int body) { return Eigen::Quaterniond(pose(body).rotation()).conjugate() * frame; };
    c.frame_a = in(c.body_a).normalized();
    c.frame_b = c.body_b < 0 ? frame : in(c.body_b).normalized();
}
/// The bodies of a table, under names that no other has: one, or the copies of its `grid`, named NAME/0, NAME/1,
/// ... (x fastest, then y, then z). The name of its material must be among `materials`, or BadInput is thrown at
/// the table's place.

std::vector<sim::WorldBody> SceneReader::named(const Fields& at, const BodyDraft& draft, double comes_s) {
    const SceneMaterial m = material_of(draft, materials, at);
    sim::WorldBody body = draft.body;
    body.material = m.material;
    body.damping_alpha = m.damping_alpha, body.damping_beta = m.damping_beta;
    body.damping_ratio = m.damping_ratio;
    if (!body.motion.empty()) {
        at.require(!draft.grid, "motion", "a motion of the copies of a grid", "a body without grid");
        at.require(body.motion.front().time_s > comes_s, "motion",
                   fmt::format("time = {} of the first key", body.motion.front().time_s),
                   fmt::format("a time after {} s, when the body is where `position` says", comes_s));
        body.motion.insert(body.motion.begin(),
                           {comes_s, body.world_from_body.translation(),
                            Eigen::Quaterniond(body.world_from_body.rotation()).normalized()});
    }
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

void SceneReader::add(const BodyDraft& draft, const std::vector<sim::WorldBody>& bodies,
                      std::vector<sim::WorldBody>& into) {
    BodyLook look{draft.look, kinds_++};
    for (std::size_t k = 0; k < bodies.size(); ++k) {
        into.push_back(bodies[k]);
        look.appearance.color = draft.color.value_or(kPalette[(look.kind + k) % kPalette.size()]);
        scene.looks.push_back(look);
    }
}

}  // namespace app
