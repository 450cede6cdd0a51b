#include "scene/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "files/assets.h"
#include "files/bad_input.h"
#include "files/toml_reader.h"
#include "kit/kit.h"
#include "scene/look_tables.h"
#include "scene/scene_bodies.h"

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr double kLongestS = 360000;  // a hundred hours

/// Reads the parts of one file in order; what was read is in `scene`.
class SceneReader {
public:
    SceneReader(const fs::path& file, const toml::table& root, std::optional<double> dt_s);
    [[nodiscard]] Scene take() { return std::move(scene_); }

private:
    void read_settings(TomlReader reader, std::optional<double> dt_s);
    void read_workers(TomlReader reader);
    void read_planes(TomlReader& top);
    void read_box(TomlReader reader);
    void add_body_table(const toml::node& node, std::vector<sim::WorldBody>& into,
                        std::vector<BodyLook>& looks);
    void read_constraint(TomlReader& reader);
    void read_events();
    sim::WorldEvent read_event(const toml::table& table);
    void read_removed(TomlReader& reader, sim::WorldEvent& event);
    void read_slowing(TomlReader reader, sim::WorldEvent& event);

    [[nodiscard]] int body_number(TomlReader& reader, std::string_view key) const;
    [[nodiscard]] const toml::table* defaults() const { return root_["defaults"].as_table(); }

    const toml::table& root_;
    Scene scene_;
    SceneMaterials materials_;
    std::map<std::string, int> bodies_, constraints_;
    std::size_t kinds_ = 0;
};

const toml::array& array_at(const toml::table& table, std::string_view key) {
    static const toml::array none;
    const toml::array* array = table[key].as_array();
    return array ? *array : none;
}

SceneReader::SceneReader(const fs::path& file, const toml::table& root, std::optional<double> dt_s)
    : root_(root) {
    scene_.file = file;
    TomlReader top({&root}, "the scene");
    scene_.name = top.text("name", file.stem().string());
    scene_.description = top.text("description", "");
    read_settings(top.table("settings"), dt_s);
    read_workers(top.table("workers"));
    materials_ = read_materials(root);
    (void)top.table("material"), (void)top.table("defaults");
    (void)top.tables("body"), (void)top.tables("event");  // are arrays of tables
    for (const toml::node& node : array_at(root, "body")) {
        if (scene_.world.bodies.size() > kMostBodies) break;
        add_body_table(node, scene_.world.bodies, scene_.looks);
    }
    for (TomlReader& reader : top.tables("constraint")) read_constraint(reader);
    read_planes(top);
    read_camera(top.table("camera"), scene_.camera);
    TomlReader room = top.table("room");
    read_room(room, scene_.room);
    scene_.drawn_scale = room.number("scale", 1e-3, 1e3, 1.0);
    room.done();
    top.done();
    read_events();
    if (scene_.looks.empty())
        throw BadInput(fmt::format("{}:1:1: error: found no [[body]], expected at least one", file.string()));
    if (scene_.looks.size() > kMostBodies)
        throw BadInput(fmt::format("{}:1:1: error: found {} bodies and more, expected at most {}",
                                   file.string(), scene_.looks.size(), kMostBodies));
}

void SceneReader::read_settings(TomlReader reader, std::optional<double> dt_s) {
    sim::WorldSettings& settings = scene_.world.settings;
    settings.dt = dt_s.value_or(reader.fraction("dt", 1e-6, 0.1, settings.dt));
    if (dt_s) (void)reader.fraction("dt", 1e-6, 0.1, settings.dt);
    settings.substeps = reader.integer("substeps", 1, 100, settings.substeps);
    settings.gravity = reader.vector("gravity", -kFarM, kFarM, settings.gravity);
    settings.sleeping = reader.flag("sleeping", settings.sleeping);
    settings.sleep_speed = reader.number("sleep_speed", 0, 100, settings.sleep_speed);
    scene_.seconds = reader.fraction("seconds", 1e-3, kLongestS, scene_.seconds);
    reader.done();
}

void SceneReader::read_workers(TomlReader reader) {
    scene_.workers.all_to_first = reader.flag("all_to_first", false);
    scene_.workers.balance_from = std::uint64_t(reader.integer("balance_from", 0, 2000000000, 0));
    reader.done();
}

void SceneReader::read_planes(TomlReader& top) {
    for (TomlReader& reader : top.tables("plane")) {
        sim::WorldPlane plane;
        plane.normal = reader.vector("normal", -kFarM, kFarM, plane.normal);
        if (plane.normal.norm() < 1e-6) reader.fail("normal", "normal = [0, 0, 0]", "a direction");
        plane.normal.normalize();
        plane.offset = reader.number("offset", -kFarM, kFarM, 0.0);
        plane.friction = reader.number("friction", 0, 10, plane.friction);
        plane.restitution = reader.number("restitution", 0, 1, plane.restitution);
        reader.done();
        scene_.world.planes.push_back(plane);
    }
    if (top.has("box"))
        read_box(top.table("box"));
    else
        (void)top.table("box");
}

/// A floor and four walls, looking inwards.
void SceneReader::read_box(TomlReader reader) {
    sim::WorldPlane plane;
    const Eigen::VectorXd size = reader.numbers("size", 2, 1e-3, 2 * kFarM);
    const Eigen::VectorXd center =
        reader.numbers("center", 2, -kFarM, kFarM, Eigen::VectorXd(Eigen::Vector2d(0, 0)));
    const double floor = reader.number("floor", -kFarM, kFarM, 0.0);
    plane.friction = reader.number("friction", 0, 10, plane.friction);
    plane.restitution = reader.number("restitution", 0, 1, plane.restitution);
    scene_.box = SceneBox{size, center, floor};
    reader.done();
    const auto add = [&](const Eigen::Vector3d& normal, double offset) {
        plane.normal = normal, plane.offset = offset;
        scene_.world.planes.push_back(plane);
    };
    add(Eigen::Vector3d::UnitY(), floor);
    for (const int side : {0, 1}) {
        const Eigen::Vector3d normal = side == 0 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitZ();
        add(normal, center[side] - 0.5 * size[side]);
        add(-normal, -center[side] - 0.5 * size[side]);
    }
}

void SceneReader::add_body_table(const toml::node& node, std::vector<sim::WorldBody>& into,
                                 std::vector<BodyLook>& looks) {
    const ReadBodies read = read_bodies(*node.as_table(), defaults(), materials_, kinds_);
    for (std::size_t k = 0; k < read.bodies.size(); ++k) {
        const auto number = static_cast<int>(bodies_.size());
        if (!bodies_.try_emplace(read.bodies[k].name, number).second)
            fail_at(node.source(), fmt::format("a second body \"{}\"", read.bodies[k].name),
                    "a name of its own");
        into.push_back(read.bodies[k]);
        looks.push_back({read.looks[k], kinds_});
    }
    ++kinds_;
}

int SceneReader::body_number(TomlReader& reader, std::string_view key) const {
    const std::string name = reader.text(key);
    const auto found = bodies_.find(name);
    if (found == bodies_.end())
        reader.fail(key, fmt::format("{} = \"{}\"", key, name),
                    "the name of a [[body]] that is there from the start (copies of a grid: NAME/0, ...)");
    return found->second;
}

/// The points are given in the bodies' frames, or both at once by a place in the world (`at`); the second
/// one's default is where the first is at the start.
void SceneReader::read_constraint(TomlReader& reader) {
    sim::PointConstraint c;
    const Eigen::Vector3d zero(0, 0, 0);
    c.name = reader.text("name", fmt::format("constraint {}", scene_.world.constraints.size()));
    c.body_a = body_number(reader, "body");
    const bool to_body = reader.has("to"), at = reader.has("at");
    c.body_b = to_body ? body_number(reader, "to") : (void(reader.text("to", "")), -1);
    if (c.body_a == c.body_b) reader.fail("to", "a body bound to itself", "another body");
    for (const char* other : {"point", "to_point", "place"})
        if (at && reader.has(other)) reader.fail("at", fmt::format("both at and {}", other), "one of them");
    for (const char* other : {to_body ? "place" : "to_point"})
        if (reader.has(other))
            reader.fail(other, fmt::format("{} {} to", other, to_body ? "beside" : "without"),
                        to_body ? "to_point, a point of that body" : "place, a point of the world");
    const auto pose = [&](int body) -> const Eigen::Isometry3d& {
        return scene_.world.bodies[std::size_t(body)].world_from_body;
    };
    c.point_a = reader.vector("point", -kFarM, kFarM, zero);
    Eigen::Vector3d place = reader.vector("at", -kFarM, kFarM, (pose(c.body_a) * c.point_a).eval());
    c.point_a = pose(c.body_a).inverse() * place;
    place = reader.vector("place", -kFarM, kFarM, place);
    const Eigen::Vector3d there = to_body ? Eigen::Vector3d(pose(c.body_b).inverse() * place) : zero;
    const Eigen::Vector3d to_point = reader.vector("to_point", -kFarM, kFarM, there);
    c.point_b = to_body ? to_point : place;
    c.stiffness = reader.number("stiffness", 1e-3, 1e12, c.stiffness);
    c.damping_ratio = reader.number("damping_ratio", 0, 100, c.damping_ratio);
    if (reader.has("breaking_force"))
        c.breaking_force = reader.number("breaking_force", 1e-6, 1e15);
    else
        (void)reader.number("breaking_force", 1e-6, 1e15, 1.0);
    reader.done();
    if (!constraints_.try_emplace(c.name, static_cast<int>(scene_.world.constraints.size())).second)
        reader.fail("name", fmt::format("a second constraint \"{}\"", c.name), "a name of its own");
    scene_.world.constraints.push_back(c);
}

void SceneReader::read_removed(TomlReader& reader, sim::WorldEvent& event) {
    const bool one = reader.has("delete") && !reader.is_array("delete");
    for (const std::string& name : one ? std::vector{reader.text("delete")} : reader.texts("delete")) {
        const auto found = constraints_.find(name);
        if (found == constraints_.end())
            reader.fail("delete", fmt::format("delete = \"{}\"", name), "the name of a [[constraint]]");
        event.removed.push_back(found->second);
    }
}

void SceneReader::read_slowing(TomlReader reader, sim::WorldEvent& event) {
    sim::Slowing slowing;
    slowing.worker = reader.integer("worker", 0, 1000);
    slowing.factor = reader.number("factor", 1, 1e6);
    reader.done();
    event.slowing.push_back(slowing);
}

sim::WorldEvent SceneReader::read_event(const toml::table& table) {
    TomlReader reader({&table}, "[[event]]");
    sim::WorldEvent event;
    if (reader.has("time") == reader.has("step"))
        reader.fail("time", reader.has("time") ? "both time and step" : "neither time nor step",
                    "one of them");
    const double time = reader.fraction("time", 0, kLongestS, 0.0);
    // The first step that begins at that time or later; a microstep of slack for times that are not exact.
    const double first = std::ceil(time / scene_.world.settings.dt - 1e-6);
    event.step = reader.has("step")
                     ? std::uint64_t(reader.integer("step", 0, 2000000000))
                     : (void(reader.integer("step", 0, 1, 0)), std::uint64_t(std::max(0.0, first)));
    read_removed(reader, event);
    (void)reader.table("add");
    if (reader.has("slow"))
        read_slowing(reader.table("slow"), event);
    else
        (void)reader.table("slow");
    reader.done();
    if (event.removed.empty() && !reader.has("add") && event.slowing.empty())
        reader.fail("delete", "an event without effect", "delete, add or slow");
    return event;
}

/// Bodies that come are numbered in the order in which they come.
void SceneReader::read_events() {
    std::vector<std::pair<sim::WorldEvent, const toml::node*>> read;
    for (const toml::node& node : array_at(root_, "event"))
        read.emplace_back(read_event(*node.as_table()), node.as_table()->get("add"));
    std::stable_sort(read.begin(), read.end(),
                     [](const auto& a, const auto& b) { return a.first.step < b.first.step; });
    for (auto& [event, added] : read) {
        event.first = scene_.later.size();
        if (added) add_body_table(*added, scene_.later, scene_.looks);
        event.end = scene_.later.size();
        scene_.events.push_back(event);
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
    const toml::table root =
        parse_toml(file, {"a scene", "the bundled ones are human, lattice, spiked, benchmark25 ..."});
    return SceneReader(file, root, dt_s).take();
}

}  // namespace app
