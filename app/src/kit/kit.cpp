#include "kit/kit.h"

#include <audio/orchestra.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <set>

#include "files/assets.h"
#include "files/bad_input.h"
#include "files/toml_reader.h"
#include "scene/look_tables.h"

namespace app {
namespace fs = std::filesystem;
namespace {

/// The parsed files of a kit, the kit itself first, then its includes in order, the assets' defaults last.
struct Layers {
    std::vector<toml::table> tables;
    std::vector<fs::path> files;
    std::vector<audio::Instrument> sounds;  ///< of the orchestra

    [[nodiscard]] std::vector<const toml::table*> at(const std::string& key,
                                                     const std::string& inner = {}) const {
        std::vector<const toml::table*> found;
        for (const toml::table& table : tables) {
            const toml::table* here = table[key].as_table();
            if (here && !inner.empty()) here = (*here)[inner].as_table();
            if (here) found.push_back(here);
        }
        return found;
    }
};

bool is_file(const fs::path& path) {
    std::error_code error;  // a name that is no path (too long) is no file
    return fs::is_regular_file(path, error);
}

void load(Layers& layers, const fs::path& file) {
    if (std::find(layers.files.begin(), layers.files.end(), file) != layers.files.end()) return;
    if (layers.files.size() > 32)
        throw BadInput(
            fmt::format("{}: error: found more than 32 included files, expected fewer", file.string()));
    layers.tables.push_back(parse_toml(file, {"a kit", "`musicworld kit list` names the bundled ones"}));
    layers.files.push_back(file);
    const std::size_t index = layers.tables.size() - 1;
    TomlReader reader({&layers.tables[index]}, "the kit");
    std::vector<fs::path> includes;
    for (const std::string& name : reader.texts("include")) {
        const fs::path beside = file.parent_path() / name;
        const fs::path bundled = assets_folder() / "kits" / name;
        if (!is_file(beside) && !is_file(bundled))
            reader.fail("include", fmt::format("include \"{}\", which is no file", name),
                        fmt::format("a file beside {} or among the bundled kits", file.filename().string()));
        includes.push_back(is_file(beside) ? beside : bundled);
    }
    for (const fs::path& include : includes) load(layers, include);
}

Eigen::Vector3d unit(TomlReader& reader, std::string_view key, const Eigen::Vector3d& fallback) {
    const Eigen::Vector3d value = reader.vector(key, -1e3, 1e3, fallback);
    if (value.norm() < 1e-6) reader.fail(key, fmt::format("{} = [0, 0, 0]", key), "a direction");
    return value.normalized();
}

sim::Material read_material(TomlReader reader) {
    sim::Material material;
    material.young_pa = reader.number("young_pa", 1e2, 1e13, material.young_pa);
    material.poisson = reader.number("poisson", -0.9, 0.495, material.poisson);
    material.density_kg_m3 = reader.number("density_kg_m3", 1, 1e5, material.density_kg_m3);
    reader.done();
    return material;
}

sim::VisualModes read_visual(TomlReader reader) {
    sim::VisualModes visual;
    visual.frequency_hz = reader.number("frequency_hz", 0.5, 50, visual.frequency_hz);
    visual.displacement = reader.number("displacement", 0, 0.2, visual.displacement);
    visual.decay_s = reader.number("decay_s", 0.05, 30, visual.decay_s);
    reader.done();
    return visual;
}

sim::Stand read_stand(TomlReader reader, const Eigen::Vector3d& semi_axes, bool& drawn) {
    sim::Stand stand;
    stand.hinged = reader.choice("kind", {"fixed", "hinge"}, "fixed") == "hinge";
    stand.pivot_body = reader.vector("pivot", -10, 10, Eigen::Vector3d(0, semi_axes.y(), 0));
    stand.axis_body = unit(reader, "axis", Eigen::Vector3d::UnitX());
    stand.frequency_hz = reader.number("frequency_hz", 0.05, 50, stand.frequency_hz);
    stand.damping_ratio = reader.number("damping_ratio", 0, 10, stand.damping_ratio);
    drawn = reader.flag("drawn", true);
    reader.done();
    return stand;
}

void read_zones(TomlReader& reader, Instrument& instrument) {
    const int note = reader.integer("midi_note", 0, 127, 38);
    for (TomlReader& entry : reader.tables("zones")) {
        sim::Zone zone;
        zone.name = entry.text("name");
        const Eigen::VectorXd radius =
            entry.numbers("radius", 2, 0, 100, Eigen::VectorXd(Eigen::Vector2d(0, 1.01)));
        const Eigen::VectorXd height =
            entry.numbers("height", 2, -100, 100, Eigen::VectorXd(Eigen::Vector2d(0.5, 2)));
        if (!(radius[0] < radius[1]))
            entry.fail("radius", "a zone without radius", "[inner, outer], inner below outer");
        if (!(height[0] < height[1]))
            entry.fail("height", "a zone without height", "[low, high], low below high");
        zone.min_radius = radius[0], zone.max_radius = radius[1];
        zone.min_height = height[0], zone.max_height = height[1];
        const int own_note = entry.integer("midi_note", 0, 127, note);
        entry.done();
        instrument.body.zones.push_back(zone);
        instrument.zones.push_back({zone.name, own_note});
    }
    if (instrument.zones.empty()) {  // no zones: all of the surface sounds
        instrument.body.zones.push_back({"body", 0, 100, -100, 100});
        instrument.zones.push_back({"body", note});
    }
}

void read_look(TomlReader reader, render::Look& look) {
    for (const char* part : {"shell", "head", "hoop", "lug", "bronze", "metal", "string", "wood", "body"}) {
        if (!reader.has(part)) {
            (void)reader.table(part);
            continue;
        }
        const render::Appearance appearance = read_appearance(reader.table(part));
        if (std::string_view(part) == "body")
            look.body = appearance;
        else
            look.parts.emplace_back(part, appearance);
    }
    reader.done();
}

fs::path read_mesh(TomlReader& reader, const std::string& fallback, const Kit& kit) {
    const std::string name = reader.text("mesh", fallback);
    for (const fs::path& folder : {kit.file.parent_path(), assets_folder() / "meshes"})
        if (is_file(folder / name)) return folder / name;
    reader.fail("mesh", fmt::format("mesh \"{}\", which is no file", name),
                fmt::format("a file beside {} or among the bundled meshes", kit.file.filename().string()));
}

audio::Voice read_voice(TomlReader reader, const Instrument& instrument,
                        const std::vector<audio::Instrument>& sounds) {
    audio::Voice voice;
    voice.name = instrument.name;
    voice.instrument = reader.text("instrument", instrument.kind);
    voice.gain_db = reader.number("gain_db", -60, 20, 0);
    const double x = instrument.body.world_from_body.translation().x();
    voice.pan = reader.number("pan", 0, 1, std::clamp(0.5 + 0.5 * x, 0.08, 0.92));
    std::string known;
    for (const audio::Instrument& sound : sounds) {
        known += (known.empty() ? "" : ", ") + sound.name;
        if (sound.name != voice.instrument) continue;
        for (const audio::Parameter& p : sound.parameters) {
            const bool given = reader.has(p.name);
            const double value = reader.number(p.name, p.minimum, p.maximum, p.fallback);
            if (given) voice.parameters.emplace_back(p.name, value);
        }
        reader.done();
        return voice;
    }
    reader.fail("instrument", fmt::format("instrument = \"{}\"", voice.instrument),
                fmt::format("one of {}", known));
}

Instrument read_instrument(const toml::table& table, const Layers& layers, const Kit& kit) {
    TomlReader first({&table}, "[[instrument]]");
    Instrument instrument;
    instrument.name = first.text("name");
    if (instrument.name.empty()) first.fail("name", "name = \"\"", "a name");
    instrument.kind = first.choice("kind", {"drum", "bell", "string", "cymbal"});
    std::vector<const toml::table*> stack = {&table};
    for (const toml::table* defaults : layers.at("defaults", instrument.kind)) stack.push_back(defaults);
    TomlReader reader(stack, fmt::format("instrument \"{}\"", instrument.name));
    (void)reader.text("name"), (void)reader.text("kind");

    sim::BodyDefinition& body = instrument.body;
    body.name = instrument.name;
    (void)reader.choice("shape", {"superquadric"}, "superquadric");
    body.shape.semi_axes = 0.5 * reader.vector("size", 0.001, 10);
    const Eigen::VectorXd exponents =
        reader.numbers("exponents", 2, 0.1, 1.9, Eigen::VectorXd(Eigen::Vector2d(1, 1)));
    body.shape.e1 = exponents[0], body.shape.e2 = exponents[1];
    body.world_from_body.translation() = reader.vector("position", -kRoomM, kRoomM);
    body.world_from_body.linear() = read_orientation(reader).toRotationMatrix();
    body.material = read_material(reader.table("material"));
    body.visual = read_visual(reader.table("visual"));
    body.visual.enabled = reader.choice("modes", {"rigid", "linear"}, "linear") == "linear";
    body.stand = read_stand(reader.table("stand"), body.shape.semi_axes, instrument.drawn_stand);
    body.restitution = reader.number("restitution", 0, 1, 0.5);
    body.stick_mass_kg = kit.stick.mass_kg;
    read_zones(reader, instrument);

    instrument.mesh = read_mesh(reader, instrument.kind + ".obj", kit);
    read_look(reader.table("look"), instrument.look);
    instrument.voice = read_voice(reader.table("sound"), instrument, layers.sounds);
    instrument.voice.choke_group = reader.text("choke_group", "");
    instrument.velocity_gamma = reader.number("velocity_curve", 0.2, 5, 1);
    reader.done();
    return instrument;
}

void read_stick(TomlReader reader, Kit& kit) {
    StickDefinition& stick = kit.stick;
    stick.length_m = reader.number("length", 0.05, 2, stick.length_m);
    if (reader.has("tip")) stick.tip = reader.vector("tip", -2, 2);
    if (reader.has("shaft")) stick.shaft = unit(reader, "shaft", -Eigen::Vector3d::UnitZ());
    stick.radius_m = reader.number("radius", 0.001, 0.1, stick.radius_m);
    stick.mass_kg = reader.number("mass", 0.001, 5, stick.mass_kg);
    stick.mesh = read_mesh(reader, "stick.obj", kit);
    // A key that is absent is known all the same.
    for (const char* key : {"tip", "shaft"})
        if (!reader.has(key)) (void)reader.numbers(key, 3, -2, 2, Eigen::VectorXd(Eigen::Vector3d::Zero()));
    reader.done();
}

void check_top_level(const Layers& layers) {
    for (const toml::table& table : layers.tables) {
        TomlReader reader({&table}, "the kit");
        (void)reader.text("name", ""), (void)reader.text("description", ""), (void)reader.texts("include");
        for (const char* key : {"stick", "camera", "room"}) (void)reader.table(key);
        TomlReader defaults = reader.table("defaults");
        for (const char* kind : {"drum", "bell", "string", "cymbal"}) (void)defaults.table(kind);
        defaults.done();
        (void)reader.tables("instrument");
        reader.done();
    }
}

}  // namespace

Kit read_kit(const fs::path& file) {
    Layers layers;
    load(layers, file);
    load(layers, assets_folder() / "kits" / "defaults.toml");
    check_top_level(layers);
    layers.sounds = audio::read_instruments(assets_folder() / "orchestra" / "musicworld.orc");

    Kit kit;
    kit.file = file;
    kit.files = layers.files;
    TomlReader top({&layers.tables.front()}, "the kit");
    kit.name = top.text("name", file.stem().string());
    kit.description = top.text("description", "");
    read_stick(TomlReader(layers.at("stick"), "[stick]"), kit);
    read_camera(TomlReader(layers.at("camera"), "[camera]"), kit.camera);
    TomlReader room(layers.at("room"), "[room]");
    read_room(room, kit.room);
    room.done();

    std::set<std::string> names;
    for (const toml::table& table : layers.tables) {
        const toml::array* instruments = table["instrument"].as_array();
        if (!instruments) continue;
        for (const toml::node& node : *instruments) {
            kit.instruments.push_back(read_instrument(*node.as_table(), layers, kit));
            if (!names.insert(kit.instruments.back().name).second)
                fail_at(node.source(), fmt::format("a second instrument \"{}\"", kit.instruments.back().name),
                        "a name of its own");
        }
    }
    if (kit.instruments.empty())
        throw BadInput(
            fmt::format("{}:1:1: error: found no [[instrument]], expected at least one", file.string()));
    if (kit.instruments.size() > 64)
        throw BadInput(fmt::format("{}:1:1: error: found {} instruments, expected at most 64", file.string(),
                                   kit.instruments.size()));
    return kit;
}

}  // namespace app
