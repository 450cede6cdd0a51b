#include "scene/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "files/assets.h"
#include "files/bad_input.h"
#include "files/toml_reader.h"
#include "scene/scene_bodies.h"
#include "scene/scene_keys.h"

namespace app {
namespace fs = std::filesystem;
namespace {

/// Puts what a file says together: bodies and constraints get numbers, events their order.
class SceneReader {
public:
    explicit SceneReader(const fs::path& file, std::optional<double> dt_s);
    [[nodiscard]] Scene read();

private:
    struct TimedEvent {
        sim::WorldEvent event;
        std::optional<BodyDraft> added;
        std::vector<sim::WorldBody> bodies;  ///< of `added`
    };

    void take_body(const Fields& at, const BodyDraft& body);
    void take_constraint(const Fields& at, const ConstraintDraft& draft);
    void take_event(const Fields& at, const EventDraft& draft);
    void place_constraint(const ConstraintDraft& draft, sim::PointConstraint& c) const;
    [[nodiscard]] std::vector<sim::WorldBody> named(const Fields& at, const BodyDraft& draft);
    void add(const BodyDraft& draft, const std::vector<sim::WorldBody>& bodies,
             std::vector<sim::WorldBody>& into);
    void add_events();

    [[nodiscard]] int body_number(const Fields& at, const char* key, const std::string& name) const;

    SceneDraft draft_;
    Scene& scene_ = draft_.scene;
    std::map<std::string, int> bodies_, constraints_;
    std::vector<TimedEvent> events_;
    std::vector<sim::WorldBody> coming_;  ///< bodies of the event that is read
    std::size_t kinds_ = 0;
};

SceneReader::SceneReader(const fs::path& file, std::optional<double> dt_s) {
    scene_.file = file;
    scene_.name = file.stem().string();
    draft_.dt_s = dt_s;
    draft_.take_body = [this](const Fields& at, const BodyDraft& body) { take_body(at, body); };
    draft_.take_added = [this](const Fields& at, const BodyDraft& body) { coming_ = named(at, body); };
    draft_.take_constraint = [this](const Fields& at, const ConstraintDraft& c) { take_constraint(at, c); };
    draft_.take_event = [this](const Fields& at, const EventDraft& event) { take_event(at, event); };
}

Scene SceneReader::read() {
    std::vector<TomlFile> layers;
    layers.emplace_back(scene_.file,
                        TomlKind{"a scene", "the bundled ones are human, lattice, spiked, benchmark25 ..."});
    read_toml(layers, "the scene", [&](Fields& keys) { kSceneFile.keys(keys, draft_); });
    add_events();
    if (scene_.world.bodies.empty())
        throw BadInput(
            fmt::format("{}:1:1: error: found no [[body]], expected at least one", scene_.file.string()));
    return std::move(scene_);
}

/// The bodies of a table, under names that no other has.
std::vector<sim::WorldBody> SceneReader::named(const Fields& at, const BodyDraft& draft) {
    std::vector<sim::WorldBody> bodies = bodies_of(draft, draft_.materials, at);
    for (const sim::WorldBody& body : bodies) {
        const auto number = static_cast<int>(bodies_.size());
        at.require(bodies_.try_emplace(body.name, number).second, "",
                   fmt::format("a second body \"{}\"", body.name), "a name of its own");
    }
    if (bodies_.size() > kMostBodies)
        throw BadInput(fmt::format("{}:1:1: error: found {} bodies and more, expected at most {}",
                                   scene_.file.string(), bodies_.size(), kMostBodies));
    return bodies;
}

void SceneReader::add(const BodyDraft& draft, const std::vector<sim::WorldBody>& bodies,
                      std::vector<sim::WorldBody>& into) {
    for (std::size_t k = 0; k < bodies.size(); ++k) {
        into.push_back(bodies[k]);
        scene_.looks.push_back({look_of(draft, kinds_, k), kinds_});
    }
    ++kinds_;
}

void SceneReader::take_body(const Fields& at, const BodyDraft& body) {
    add(body, named(at, body), scene_.world.bodies);
}

int SceneReader::body_number(const Fields& at, const char* key, const std::string& name) const {
    const auto found = bodies_.find(name);
    at.require(found != bodies_.end(), key, fmt::format("{} = \"{}\"", key, name),
               "the name of a [[body]] that is there from the start (copies of a grid: NAME/0, ...)");
    return found->second;
}

/// The points are given in the bodies' frames, or both at once by a place in the world (`at`); the second
/// one's default is where the first is at the start.
void SceneReader::place_constraint(const ConstraintDraft& draft, sim::PointConstraint& c) const {
    const auto pose = [&](int body) -> const Eigen::Isometry3d& {
        return scene_.world.bodies[std::size_t(body)].world_from_body;
    };
    const Eigen::Vector3d point = draft.point.value_or(Eigen::Vector3d::Zero());
    const Eigen::Vector3d start = draft.at.value_or(pose(c.body_a) * point);
    c.point_a = pose(c.body_a).inverse() * start;
    c.point_b = draft.place.value_or(start);
    if (c.body_b >= 0) c.point_b = draft.to_point.value_or(pose(c.body_b).inverse() * c.point_b);
}

void SceneReader::take_constraint(const Fields& at, const ConstraintDraft& draft) {
    sim::PointConstraint c = draft.constraint;
    if (c.name.empty()) c.name = fmt::format("constraint {}", scene_.world.constraints.size());
    c.body_a = body_number(at, "body", draft.body);
    if (draft.to) c.body_b = body_number(at, "to", *draft.to);
    at.require(c.body_a != c.body_b, "to", "a body bound to itself", "another body");
    const auto one_of = [&](bool other, const char* key) {
        at.require(!draft.at || !other, "at", fmt::format("both at and {}", key), "one of them");
    };
    one_of(draft.point.has_value(), "point");
    one_of(draft.to_point.has_value(), "to_point");
    one_of(draft.place.has_value(), "place");
    at.require(!draft.to || !draft.place, "place", "place beside to", "to_point, a point of that body");
    at.require(draft.to || !draft.to_point, "to_point", "to_point without to", "place, a point of the world");
    place_constraint(draft, c);
    at.require(constraints_.try_emplace(c.name, static_cast<int>(constraints_.size())).second, "name",
               fmt::format("a second constraint \"{}\"", c.name), "a name of its own");
    scene_.world.constraints.push_back(c);
}

void SceneReader::take_event(const Fields& at, const EventDraft& draft) {
    TimedEvent timed{{}, draft.added, std::move(coming_)};
    at.require(draft.time_s.has_value() != draft.step.has_value(), "time",
               draft.time_s ? "both time and step" : "neither time nor step", "one of them");
    // The first step that begins at that time or later; a microstep of slack for times that are not exact.
    const double first = std::ceil(draft.time_s.value_or(0) / scene_.world.settings.dt - 1e-6);
    timed.event.step = draft.step.value_or(std::uint64_t(std::max(0.0, first)));
    for (const std::string& name : draft.removed) {
        const auto found = constraints_.find(name);
        at.require(found != constraints_.end(), "delete", fmt::format("delete = \"{}\"", name),
                   "the name of a [[constraint]]");
        timed.event.removed.push_back(found->second);
    }
    if (draft.slowing) timed.event.slowing.push_back(*draft.slowing);
    at.require(!draft.removed.empty() || draft.added || draft.slowing, "delete", "an event without effect",
               "delete, add or slow");
    events_.push_back(std::move(timed));
}

/// Bodies that come are numbered in the order in which they come.
void SceneReader::add_events() {
    std::stable_sort(events_.begin(), events_.end(),
                     [](const TimedEvent& a, const TimedEvent& b) { return a.event.step < b.event.step; });
    for (TimedEvent& timed : events_) {
        timed.event.first = scene_.later.size();
        if (timed.added) add(*timed.added, timed.bodies, scene_.later);
        timed.event.end = scene_.later.size();
        scene_.events.push_back(timed.event);
    }
}

}  // namespace

fs::path find_scene(const std::string& name_or_path) {
    std::error_code error;
    const fs::path bundled = assets_folder() / "scenes" / (name_or_path + ".toml");
    if (name_or_path.find('/') == std::string::npos && fs::is_regular_file(bundled, error)) return bundled;
    return name_or_path;
}

Scene read_scene(const fs::path& file, std::optional<double> dt_s) {
    return SceneReader(file, dt_s).read();
}

}  // namespace app
