#include "kit/kit.h"

#include <audio/orchestra.h>
#include <audio/own_orchestra.h>
#include <audio/samples.h>
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "files/assets.h"
#include "files/bad_input.h"
#include "files/format_description.h"
#include "files/toml_reader.h"
#include "kit/kit_mix.h"
#include "kit/mesh_contact.h"
#include "scene/shared_keys.h"

namespace app {
namespace fs = std::filesystem;
namespace {

// The keys of a kit file. `mesh` is a name until it is looked for.

bool is_file(const fs::path& path) {
    std::error_code error;  // a name that is no path (too long) is no file
    return fs::is_regular_file(path, error);
}

/// The file of that name beside the file that names it, beside the kit or, if there is such a folder, in a folder of
/// bundled ones.
fs::path find_file(const Fields& at, const char* key, const fs::path& name, const fs::path& kit,
                   const char* bundled) {
    const fs::path beside = kit.parent_path() / name;
    std::vector<fs::path> places = {beside};
    if (const std::string file = at.file_of(key); !file.empty())
        places.insert(places.begin(), fs::path(file).parent_path() / name);
    if (bundled) places.push_back(assets_folder() / bundled / name);
    const auto found = std::ranges::find_if(places, is_file);
    at.require(found != places.end(), key, fmt::format("{} \"{}\", which is no file", key, name.string()),
               fmt::format("a file beside {}{}", kit.filename().string(),
                           bundled ? fmt::format(" or among the bundled {}", bundled) : ""));
    return found == places.end() ? beside : *found;
}

/// What a library reads; its complaints, which name their place, become BadInput.
auto read_sound(const auto& read) {
    try {
        return read();
    } catch (const std::runtime_error& wrong) {
        throw BadInput(wrong.what());
    }
}

// Tables within an instrument

const TableKind<sim::Material> kMaterial = {
    {"material", "What the body is made of: gives its mass and the ratios of its visible modes."},
    material_keys};

void visual_keys(Fields& keys, sim::VisualModes& visual) {
    keys.number("frequency_hz", visual.frequency_hz, {0.5, 50, "Hz"},
                "Frequency of the lowest visible mode.");
    keys.number("displacement", visual.displacement, {0, 0.2},
                "Displacement of the struck point by a stroke of 5 m/s, as a share of the largest extent.");
    keys.number("decay_s", visual.decay_s, {0.05, 30, "s"}, "Time in which the visible modes fall by 60 dB.");
}
const TableKind<sim::VisualModes> kVisual = {
    {"visual", "The modes that are seen, softer than what is heard."}, visual_keys};

void stand_keys(Fields& keys, Instrument& instrument) {
    sim::Stand& stand = instrument.body.stand;
    keys.choice("kind", stand.hinged, {{"fixed", false}, {"hinge", true}}, "fixed, or on a damped hinge.");
    keys.vector("pivot", stand.pivot_body, {-10, 10, "m"}, "Point of the hinge's axis in the body's frame.",
                {.otherwise = "the middle of the top", .example = "[0, 0.07, 0]"});
    keys.vector("axis", stand.axis_body, {-1e3, 1e3},
                "Direction of the hinge's axis in the body's frame; any length but 0.");
    keys.require_direction(stand.axis_body, "axis");
    stand.axis_body.normalize();
    keys.number("frequency_hz", stand.frequency_hz, {0.05, 50, "Hz"}, "Frequency at which the body swings.");
    keys.number("damping_ratio", stand.damping_ratio, {0, 10}, "Damping ratio of the swing: 1 is critical.");
    keys.flag("drawn", instrument.drawn_stand, "Whether a stand is drawn down to the floor.");
}
const TableKind<Instrument> kStand = {{"stand", "How the body is held."}, stand_keys};

struct ZoneDraft {
    sim::Zone zone;
    std::optional<int> midi_note;
};
void zone_keys(Fields& keys, ZoneDraft& written) {
    Eigen::Vector2d radius(0, 1.01), height(0.5, 2);
    keys.text("name", written.zone.name, "Name of the zone.", {.need = Need::given, .example = "\"head\""});
    keys.vector("radius", radius, {0, 100},
                "Inner and outer limit of sqrt((x/a)^2 + (z/c)^2); 0 is the axis.");
    keys.vector("height", height, {-100, 100}, "Lower and upper limit of y/b: -1 underside, 1 top.");
    keys.require(radius[0] < radius[1], "radius", "a zone without radius",
                 "[inner, outer], inner below outer");
    keys.require(height[0] < height[1], "height", "a zone without height", "[low, high], low below high");
    keys.integer("midi_note", written.midi_note, {0, 127}, "MIDI note.",
                 {.otherwise = "the instrument's", .example = "38"});
    written.zone.min_radius = radius[0], written.zone.max_radius = radius[1];
    written.zone.min_height = height[0], written.zone.max_height = height[1];
}
const TableKind<ZoneDraft> kZone = {
    {"zone", "A part of the surface, in shares of the half extents (a, b, c)."}, zone_keys};

void appearance_keys(Fields& keys, render::Appearance& look) {
    keys.vector("color", look.color, {0, 1}, "Linear RGB.");
    surface_keys(keys, look);
}
const TableKind<render::Appearance> kAppearance = {{"appearance", "How a surface looks."}, appearance_keys};

void look_keys(Fields& keys, render::Look& look) {
    for (const char* part : {"shell", "head", "hoop", "lug", "bronze", "metal", "string", "wood"}) {
        std::optional<render::Appearance> appearance;
        keys.table(part, appearance, kAppearance);
        if (appearance) look.parts.emplace_back(part, *appearance);
    }
    keys.table("body", look.body, kAppearance);
}
const TableKind<render::Look> kLook = {
    {"look", "Looks of the mesh's materials by name; `body` is the look of all others."}, look_keys};

/// The parameters of a sound, which must be one of the orchestra's.
std::vector<ParameterRange> parameters_of(const std::string& sound, Fields& keys,
                                          const std::vector<audio::Instrument>& orchestra) {
    const auto found = std::ranges::find(orchestra, sound, &audio::Instrument::name);
    std::vector<std::string> known;
    for (const audio::Instrument& instrument : orchestra) known.push_back(instrument.name);
    keys.require(found != orchestra.end(), "instrument", fmt::format("instrument = \"{}\"", sound),
                 fmt::format("one of {}", fmt::join(known, ", ")));
    std::vector<ParameterRange> parameters;
    if (found == orchestra.end()) return parameters;  // nothing is read, only described
    for (const audio::Parameter& p : found->parameters) parameters.push_back({p.name, p.minimum, p.maximum});
    return parameters;
}

/// An instrument as it is written: `mesh` is a name (empty: KIND.obj).
struct InstrumentDraft {
    Instrument instrument;
    const std::vector<audio::Instrument>* orchestra = nullptr;  ///< the sounds that there are
    fs::path kit{};                                             ///< the kit's file
    fs::path samples{};                                         ///< empty: none
    std::vector<ParameterRange> parameters{};                   ///< of its sound
    std::optional<int> keyswitch{};
    std::vector<std::string> without_effect{};  ///< keys of the orchestra's sound beside samples
    bool fitted = false;                        ///< the body's surface to the mesh
};

/// The sounds that there are, with those of an orchestra of one's own.
std::vector<audio::Instrument> with_own(const std::vector<audio::Instrument>& bundled, const fs::path& own,
                                        const Fields& keys) {
    std::vector<std::string> taken = {"sample"};
    for (const audio::Instrument& instrument : bundled) taken.push_back(instrument.name);
    std::vector<audio::Instrument> all = bundled;
    const std::vector<audio::Instrument> added = read_sound(
        [&] { return audio::parse_instruments(audio::read_own_orchestra(own, taken), own.string()); });
    for (const audio::Instrument& instrument : added) {
        keys.require(std::ranges::find(taken, instrument.name) == taken.end(), "orchestra",
                     fmt::format("a second `{}` in {}", instrument.name, own.string()), "names of its own");
        all.push_back(instrument);
    }
    return all;
}

void sound_keys(Fields& keys, InstrumentDraft& written) {
    audio::Voice& voice = written.instrument.voice;
    const std::string chosen_by_kind = voice.instrument;
    keys.text("instrument", voice.instrument, "Name of the instrument in the orchestra.",
              {.otherwise = "the kind", .example = "\"drum\""});
    keys.number("gain_db", voice.gain_db, {-60, 20, "dB"}, "Gain.");
    keys.number("pan", voice.pan, {0, 1}, "0 left ... 1 right, constant power.",
                {.otherwise = "from the position's x", .example = "0.5"});
    std::string samples, own;
    keys.text(
        "samples", samples,
        "Recorded sounds instead of the orchestra's: a file beside this one. WAV, FLAC or another sound "
        "file; SFZ; "
        "SoundFont (.sf2); DrumGizmo (.xml). A zone's midi_note chooses the key, the speed the velocity: "
        "127 (v / 8 m/s)^0.7.",
        {.example = "\"snare.wav\""});
    if (!samples.empty()) written.samples = find_file(keys, "samples", samples, written.kit, nullptr);
    keys.integer("keyswitch", written.keyswitch, {0, 127},
                 "Of SFZ: the key that is held down to choose among its ways of playing (sw_last).",
                 {.otherwise = "the file's", .example = "36"});
    keys.text("orchestra", own,
              "A Csound orchestra of your own, a file beside this one, in which `instrument` may be.",
              {.example = "\"mine.orc\""});
    static const std::vector<audio::Instrument> kNone;
    std::vector<audio::Instrument> known = written.orchestra ? *written.orchestra : kNone;
    if (!own.empty()) {
        const fs::path file = find_file(keys, "orchestra", own, written.kit, nullptr);
        const std::size_t bundled = known.size();
        known = with_own(known, file, keys);
        const auto found = std::ranges::find(known, voice.instrument, &audio::Instrument::name);
        if (found - known.begin() >= static_cast<std::ptrdiff_t>(bundled)) voice.own_orchestra = file;
    }
    written.parameters = parameters_of(voice.instrument, keys, known);
    if (!samples.empty()) {
        const auto note = [&](const std::string& key) {
            if (keys.stands_over(key, "samples")) written.without_effect.push_back(key);
        };
        for (const char* key : {"instrument", "orchestra"}) note(key);
        for (const ParameterRange& parameter : written.parameters) note(parameter.name);
    }
    keys.parameters(
        voice.parameters, written.parameters, {-1e9, 1e9},
        "A parameter of the orchestra's instrument. The header of assets/orchestra/musicworld.orc lists "
        "them with their ranges.",
        {"instrument", chosen_by_kind});
}
const TableKind<InstrumentDraft> kSound = {
    {"sound", "The orchestra's instrument and its parameters.", Below::nothing, "{ instrument = \"NAME\" }"},
    sound_keys};

void pedal_sound_keys(Fields& keys, InstrumentDraft& written) {
    keys.parameters(
        written.instrument.voice.pedal_parameters, written.parameters, {-1e9, 1e9},
        "A parameter of the instrument's sound as it is with the pedal away from its rest; on the way "
        "there it goes evenly.",
        {"instrument", written.instrument.voice.instrument});
}
const TableKind<InstrumentDraft> kPedalSound = {
    {"pedal_sound", "What the pedal changes of the sound.", Below::nothing, "{ decay_s = 2 }"},
    pedal_sound_keys};

void pedal_keys(Fields& keys, InstrumentDraft& written) {
    using Kind = Pedal::Kind;
    Pedal& pedal = written.instrument.pedal;
    keys.choice(
        "kind", pedal.kind,
        {{"none", Kind::none}, {"hi-hat", Kind::hi_hat}, {"damper", Kind::damper}, {"beater", Kind::beater}},
        "hi-hat: from 0 closed (at rest) to 1 open, closing ends what rings; damper: from 1 free (at rest) "
        "to "
        "0 damped, damping ends what rings; beater: strikes the instrument.");
    keys.integer("midi_note", pedal.midi_note, {0, 127},
                 "MIDI note of strokes while the pedal is away from its rest (46: open hi-hat).",
                 {.otherwise = "the zone's", .example = "46"});
    keys.integer("foot_note", pedal.foot_note, {0, 127}, "MIDI note of a hi-hat that closes.");
    keys.table("sound", written, kPedalSound);
}
const TableKind<InstrumentDraft> kPedal = {
    {"pedal", "What a foot does to the instrument; `play --pedals` and `--midi-in` move it."}, pedal_keys};

// [[instrument]]

void body_keys(Fields& keys, InstrumentDraft& written) {
    Instrument& instrument = written.instrument;
    sim::BodyDefinition& body = instrument.body;
    keys.choice(
        "shape", written.fitted, {{"superquadric", false}, {"mesh", true}},
        "Surface that is struck: superquadric, of `size` and `exponents` about `position`; mesh, the "
        "superquadric that comes nearest to the mesh as it is drawn, the mesh's origin at `position`. "
        "`kit check` says how near.");
    Eigen::Vector3d size(0, 0, 0), position(0, 0, 0);
    Eigen::Vector2d exponents(1, 1);
    keys.vector(
        "size", size, {0.001, 10, "m"},
        "Full extents along the body's x, y, z. y is the axis of a drum, bell or cymbal; x the direction of "
        "a string.",
        {.need = Need::given, .example = "[0.36, 0.14, 0.36]"});
    keys.vector(
        "exponents", exponents, {0.1, 1.9},
        "Exponents e1 (profile along y) and e2 (section across y) of the superquadric "
        "((|x/a|^(2/e2) + |z/c|^(2/e2))^(e2/e1)) + |y/b|^(2/e1) = 1: [0.1, 1] a drum, [1, 1] an ellipsoid, "
        "[0.2, 0.2] a bar.");
    keys.vector("position", position, {-kRoomM, kRoomM, "m"},
                "Centre of the body, world: y up, the player at the origin looks along -z.",
                {.need = Need::given, .example = "[0, 0.7, -0.45]"});
    body.shape.semi_axes = 0.5 * size;
    instrument.given_size_m = size.maxCoeff();
    body.shape.e1 = exponents[0], body.shape.e2 = exponents[1];
    body.world_from_body.translation() = position;
    Eigen::Quaterniond orientation;
    orientation_keys(keys, orientation);
    body.world_from_body.linear() = orientation.toRotationMatrix();
    keys.table("material", body.material, kMaterial);
    keys.table("visual", body.visual, kVisual);
    keys.choice("modes", body.visual.enabled, {{"rigid", false}, {"linear", true}},
                "How deformable: rigid, or the six linear modes (scale and shear) of the body.");
    body.stand.pivot_body = {0, body.shape.semi_axes.y(), 0};
    keys.table("stand", instrument, kStand);
    keys.number("restitution", body.restitution, {0, 1},
                "Share of its speed that a stick keeps when it rebounds.");
}

void zones_keys(Fields& keys, Instrument& instrument) {
    int note = 38;
    keys.integer(
        "midi_note", note, {0, 127},
        "MIDI note of zones that name none (General MIDI percussion: 38 snare, 42 closed hi-hat, 49 crash, "
        "51 ride ...).");
    keys.tables(
        "zones", ZoneDraft(), kZone,
        "Parts of the surface that sound, in the body's coordinates at rest; where none holds the struck "
        "point the body is silent. Without zones all of the surface sounds, as one zone `body`. The first "
        "zone is zone 0 of the orchestra's instrument, the next zone 1.",
        [&](Fields&, const ZoneDraft& zone) {
            instrument.body.zones.push_back(zone.zone);
            instrument.zones.push_back({zone.zone.name, zone.midi_note.value_or(note)});
        });
    if (!instrument.zones.empty()) return;
    instrument.body.zones.push_back({"body", 0, 100, -100, 100});
    instrument.zones.push_back({"body", note});
}

void instrument_keys(Fields& keys, InstrumentDraft& written) {
    Instrument& instrument = written.instrument;
    keys.text("name", instrument.name,
              "Name, different from all others of the file. An instrument of that name in an included file "
              "is changed: "
              "keys that are given here stand over its own.",
              {.need = Need::here, .example = "\"snare\""});
    keys.choice("kind", instrument.kind,
                {{"drum", "drum"}, {"bell", "bell"}, {"string", "string"}, {"cymbal", "cymbal"}},
                "What it is; chooses the defaults.", {.need = Need::own, .example = "\"drum\""});
    body_keys(keys, written);
    zones_keys(keys, instrument);
    std::string mesh = instrument.kind + ".obj";
    keys.text("mesh", mesh,
              "Mesh (OBJ, GLB, glTF or STL) that is drawn, a file beside the kit or a bundled one; it is "
              "scaled by the "
              "half extents, so it should fill [-1, 1] in x, y, z.",
              {.otherwise = "KIND.obj", .example = "\"drum.obj\""});
    instrument.mesh = mesh;
    keys.number("mesh_scale", instrument.mesh_scale_m, {1e-6, 1e3, "m"},
                "Length of one unit of the mesh, which then keeps its own size: 1 for a mesh in metres, "
                "0.001 for one in "
                "millimetres. `kit check` says which fits.",
                {.otherwise = "the half extents", .example = "0.001"});
    keys.table("look", instrument.look, kLook);
    audio::Voice& voice = instrument.voice;
    voice.name = instrument.name;
    voice.instrument = instrument.kind;
    voice.pan = std::clamp(0.5 + 0.4 * instrument.body.world_from_body.translation().x(), 0.2, 0.8);
    keys.table("sound", written, kSound);
    keys.text("choke_group", voice.choke_group,
              "Instruments of one group silence each other (an open and a closed hi-hat); empty: none.");
    keys.number("tip_choke_s", instrument.tip_choke_s, {0, 10, "s"},
                "A stick's tip that rests on it for so long ends what it rings, as a hand does; 0: never.");
    keys.table("pedal", written, kPedal);
    keys.text("bus", instrument.bus, "Name of the [[bus]] that it is mixed in; empty: none.",
              {.example = "\"drums\""});
    keys.number("velocity_curve", instrument.velocity_gamma, {0.2, 5},
                "Exponent g of loudness: a stroke of v m/s sounds like one of 5 (v / 5)^g m/s.");
}
const TableKind<InstrumentDraft> kInstrument = {
    {"instrument", "One playable thing.", Below::defaults_of_kind}, instrument_keys};

/// Gives the sound what it wants to know of the stick, where the kit's own parameters do not say it.
void add_tip(audio::Voice& voice, const StickDefinition& stick,
             const std::vector<audio::Instrument>& orchestra) {
    const auto sound = std::ranges::find(orchestra, voice.instrument, &audio::Instrument::name);
    if (sound == orchestra.end()) return;
    const std::pair<std::string, double> tip[] = {
        {"tip_radius_m", stick.radius_m}, {"tip_mass_kg", stick.mass_kg}, {"tip_young_pa", stick.young_pa}};
    for (const auto& each : tip) {
        const auto named = [&](const auto& parameter) { return parameter.first == each.first; };
        if (std::ranges::find(sound->parameters, each.first, &audio::Parameter::name) !=
                sound->parameters.end() &&
            std::ranges::none_of(voice.parameters, named))
            voice.parameters.push_back(each);
    }
}

// The file

/// What each file of a kit says for itself.
struct KitHeader {
    std::string name, description;
    std::vector<std::string> include, remove;
};
void header_keys(Fields& keys, KitHeader& header) {
    keys.text("name", header.name, "Name of the kit.", {.otherwise = "the file's", .example = "\"Drums\""});
    keys.text("description", header.description, "One line about it.");
    keys.texts("include", header.include,
               "Further kit files, relative to this one or among the bundled kits. Their instruments join "
               "this kit's.",
               {.example = "[\"bells.toml\"]"});
    keys.texts("remove", header.remove, "Names of instruments of the included files that are left out.",
               {.example = "[\"C5\"]"});
}

/// A kit as its files say it.
struct KitDraft {
    Kit kit;
    std::vector<audio::Instrument> orchestra;
    std::set<std::string> names;  ///< of its instruments
    audio::SampleLibrary* sample_library = nullptr;
};

void stick_keys(Fields& keys, StickDefinition& stick) {
    keys.number("length", stick.length_m, {0.05, 2, "m"}, "Length of the drawn stick, hand to tip.");
    keys.vector("tip", stick.tip, {-2, 2, "m"}, "Centre of the tip in the tracked body's frame.",
                {.otherwise = "the trace's", .example = "[0, 0, -0.4]"});
    keys.vector("shaft", stick.shaft, {-1e3, 1e3},
                "Direction from hand to tip in the tracked body's frame, any length but 0.",
                {.otherwise = "the trace's", .example = "[0, 0, -1]"});
    if (stick.shaft) {
        keys.require_direction(*stick.shaft, "shaft");
        stick.shaft->normalize();
    }
    keys.number("radius", stick.radius_m, {0.001, 0.1, "m"}, "Radius of the tip.");
    keys.number("mass", stick.mass_kg, {0.001, 5, "kg"}, "Effective mass of the stick in a stroke.");
    keys.number(
        "young_pa", stick.young_pa, {1e4, 1e12, "Pa"},
        "Young's modulus of the tip: hard wood 1e10, rubber 1e7, felt 1e6; with its radius and mass it says "
        "how long a stroke touches (Hertz), so how bright it is.");
    std::string mesh = stick.mesh.empty() ? "stick.obj" : stick.mesh.string();
    keys.text("mesh", mesh,
              "Mesh of the stick: 0.40 m along -z from the hand at the origin; a file beside the kit or a "
              "bundled one.");
    stick.mesh = mesh;
}
const TableKind<StickDefinition> kStick = {{"stick", "The sticks."}, stick_keys};

const TableKind<render::Room> kRoom = {{"room", "The room."}, room_keys};

void defaults_keys(Fields& keys, KitDraft&) {
    for (const char* kind : {"drum", "bell", "string", "cymbal"}) keys.partial_table(kind, kInstrument);
}
const TableKind<KitDraft> kDefaults = {
    {"defaults", "What instruments of a kind have unless they say otherwise."}, defaults_keys};

/// Places the mesh in the body's frame; with shape = "mesh" the body becomes what fits it.
void place_mesh(const Fields& at, InstrumentDraft& read) {
    Instrument& instrument = read.instrument;
    sim::BodyDefinition& body = instrument.body;
    instrument.body_from_mesh = Eigen::Affine3d(
        instrument.mesh_scale_m ? Eigen::Scaling(Eigen::Vector3d::Constant(*instrument.mesh_scale_m).eval())
                                : Eigen::Scaling(body.shape.semi_axes));
    if (!read.fitted) return;
    const std::vector<Eigen::Vector3d> points =
        outer_surface(render::load_mesh(instrument.mesh), instrument.body_from_mesh).points;
    const std::string mesh = fmt::format("the mesh {}", instrument.mesh.string());
    sim::SuperquadricFit fit;
    try {
        fit = sim::fit_superquadric(points);
    } catch (const std::invalid_argument&) {
        at.require(false, "mesh", mesh + " without volume",
                   "a body's surface, its triangles counter-clockwise seen from outside");
    }
    const Eigen::Vector3d size = 2 * fit.shape.semi_axes;
    at.require(size.minCoeff() >= 0.001 && size.maxCoeff() <= 10, "mesh",
               fmt::format("{} of {:.3g} x {:.3g} x {:.3g} m", mesh, size.x(), size.y(), size.z()),
               "0.001 to 10 m; mesh_scale is the length of its unit, 0.001 for millimetres");
    body.shape = fit.shape;
    body.world_from_body.translation() += body.world_from_body.linear() * fit.centre;
    body.stand.pivot_body -= fit.centre;
    instrument.body_from_mesh.pretranslate(-fit.centre);
    instrument.fitted = fit.error;
}

/// Reads the recorded sounds of an instrument for the MIDI notes of its zones.
void take_samples(InstrumentDraft& read, Kit& kit, audio::SampleLibrary& library) {
    audio::Voice& voice = read.instrument.voice;
    const auto note = [&](const fs::path& file) {
        if (std::ranges::find(kit.sound_files, file) == kit.sound_files.end())
            kit.sound_files.push_back(file);
    };
    if (!voice.own_orchestra.empty()) note(voice.own_orchestra);
    if (read.samples.empty()) return;
    std::vector<int> notes;
    for (const ZoneSound& zone : read.instrument.zones) notes.push_back(zone.midi_note);
    const Pedal& pedal = read.instrument.pedal;
    if (pedal.midi_note) notes.push_back(*pedal.midi_note);
    if (pedal.kind == Pedal::Kind::hi_hat) notes.push_back(pedal.foot_note);
    voice.samples =
        read_sound([&] { return audio::read_samples(read.samples, notes, library, read.keyswitch); });
    if (voice.choke_group.empty()) voice.choke_group = voice.samples->choke_group;
    for (const fs::path& file : voice.samples->files) note(file);
    const auto is_decay = [](const auto& parameter) { return parameter.first == "decay_s"; };
    if (std::ranges::any_of(voice.pedal_parameters, is_decay)) std::erase(read.without_effect, "decay_s");
    if (read.without_effect.empty()) return;
    audio::SampleSet told = *voice.samples;
    for (const std::string& key : read.without_effect)
        told.ignored.push_back(fmt::format("{} of \"{}\" in the kit", key, read.instrument.name));
    voice.samples = std::make_shared<const audio::SampleSet>(std::move(told));
}

void kit_keys(Fields& keys, KitDraft& written) {
    KitHeader header;
    header_keys(keys, header);
    Kit& kit = written.kit;
    keys.table("stick", kit.stick, kStick, [&](Fields& at, StickDefinition& stick) {
        stick.mesh = find_file(at, "mesh", stick.mesh, kit.file, "meshes");
    });
    KitMix mix{.mix = kit.mix};
    keys.table("mix", mix, kMix, [&](Fields& at, KitMix& read) {
        kit.mix = read.mix;
        if (read.room_impulse.empty()) return;
        const fs::path impulse = find_file(at, "room_impulse", read.room_impulse, kit.file, nullptr);
        kit.mix.room.impulse = read_sound([&] { return audio::read_impulse_response(impulse); });
        kit.sound_files.push_back(impulse);
    });
    keys.tables("bus", Bus(), kBus, "Groups that instruments are mixed in.",
                [&](Fields& at, const Bus& read) {
                    at.require(std::ranges::find(kit.buses, read.name, &Bus::name) == kit.buses.end(), "name",
                               fmt::format("a second bus \"{}\"", read.name), "a name of its own");
                    kit.buses.push_back(read);
                });
    keys.table("camera", kit.camera, kCamera);
    keys.table("room", kit.room, kRoom);
    keys.table("defaults", written, kDefaults);
    keys.tables(
        "instrument", InstrumentDraft{{}, &written.orchestra, kit.file}, kInstrument,
        "The playable things, 1 to 64 with all included files.", [&](Fields& at, InstrumentDraft& read) {
            Instrument& instrument = read.instrument;
            instrument.body.name = instrument.name;
            instrument.body.stick_mass_kg = kit.stick.mass_kg;
            add_tip(instrument.voice, kit.stick, written.orchestra);
            instrument.mesh = find_file(at, "mesh", instrument.mesh, kit.file, "meshes");
            place_mesh(at, read);
            at.require(written.names.insert(instrument.name).second, "",
                       fmt::format("a second instrument \"{}\"", instrument.name), "a name of its own");
            take_samples(read, kit, *written.sample_library);
            mix_in(at, instrument, kit.buses);
            kit.instruments.push_back(instrument);
        });
}

const TableKind<KitDraft> kKitFile = {{"kit",
                                       "A kit file (TOML). Lengths in m, times in s, y up, right-handed. "
                                       "Values come from the kit, then the files that "
                                       "it includes in their order, then defaults.toml of the bundled kits; "
                                       "of an instrument: from itself, then "
                                       "[defaults.KIND] of the same files. Tables are merged key by key."},
                                      kit_keys};

// Reading

/// Adds a file of a kit: the kit itself first, then its includes in order, the assets' defaults last.
void load(Kit& kit, std::vector<TomlFile>& documents, const fs::path& file,
          const TomlFile* includer = nullptr) {
    if (std::ranges::find(kit.files, file) != kit.files.end()) return;
    if (kit.files.size() > 32)
        throw BadInput(
            fmt::format("{}: error: found more than 32 included files, expected fewer", file.string()));
    const TomlFile document("a kit", file, includer);
    KitHeader header{file.stem().string(), {}, {}, {}};
    std::vector<fs::path> includes;
    const auto read_header = [&](Fields& keys) {
        header_keys(keys, header);
        for (const std::string& name : header.include)
            includes.push_back(find_file(keys, "include", name, file, "kits"));
    };
    read_toml({document}, "the kit", read_header, false);
    if (kit.files.empty()) kit.name = header.name, kit.description = header.description;
    kit.files.push_back(file);
    documents.push_back(document);
    for (const fs::path& include : includes) load(kit, documents, include, &document);
}

}  // namespace

Kit read_kit(const fs::path& file) {
    audio::SampleLibrary library;
    KitDraft written;
    written.sample_library = &library;
    Kit& kit = written.kit;
    kit.file = file;
    std::vector<TomlFile> documents;
    load(kit, documents, file);
    load(kit, documents, assets_folder() / "kits" / "defaults.toml");
    written.orchestra = audio::read_instruments(assets_folder() / "orchestra" / "musicworld.orc");
    read_toml(documents, "the kit", [&](Fields& keys) { kKitFile.keys(keys, written); });
    if (kit.instruments.empty())
        throw BadInput(
            fmt::format("{}:1:1: error: found no [[instrument]], expected at least one", file.string()));
    if (kit.instruments.size() > 64)
        throw BadInput(fmt::format("{}:1:1: error: found {} instruments, expected at most 64", file.string(),
                                   kit.instruments.size()));
    return kit;
}

std::vector<sim::BodyDefinition> bodies_of(const Kit& kit) {
    std::vector<sim::BodyDefinition> bodies;
    for (const Instrument& instrument : kit.instruments) bodies.push_back(instrument.body);
    return bodies;
}

FormatDescription kit_format() {
    KitDraft written;
    written.kit.file = assets_folder() / "kits" / "defaults.toml";
    read_toml({TomlFile("the kits' defaults", written.kit.file)}, "the kits' defaults",
              [&](Fields& keys) { kKitFile.keys(keys, written); });
    written.kit.stick.mesh = written.kit.stick.mesh.filename();
    return describe_format(kKitFile, written);
}

}  // namespace app
