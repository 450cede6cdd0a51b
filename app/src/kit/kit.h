#pragma once
#include <audio/performance.h>
#include <render/scene.h>
#include <sim/modal_body.h>
#include <sim/superquadric_fit.h>
#include <tracking/trace.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace app {

struct FormatDescription;

/// What a zone of an instrument sends to MIDI.
struct ZoneSound {
    std::string name;
    int midi_note = 38;
};

/// What a foot does to an instrument.
struct Pedal {
    enum class Kind {
        none,
        hi_hat,  ///< 0 closed ... 1 open, closed at rest; closing ends what rings and sounds itself
        damper,  ///< 0 damped ... 1 free, free at rest; damping ends what rings
        beater,  ///< strikes the instrument
    } kind = Kind::none;
    std::optional<int> midi_note;  ///< of strokes while the pedal is away from its rest
    int foot_note = 44;            ///< MIDI note of what a hi-hat sounds when it closes
    bool operator==(const Pedal&) const = default;
};

/// Instruments that are mixed together.
struct Bus {
    std::string name;
    double gain_db = 0;
    double balance = 0;       ///< -1 left alone ... 1 right alone
    double room_send_db = 0;  ///< -60: the room hears nothing of it
};

/// One playable thing of a kit: its body, its look and its sound.
struct Instrument {
    std::string name;
    std::string kind;  ///< drum | bell | string | cymbal
    sim::BodyDefinition body;
    std::filesystem::path
        mesh;  ///< unit mesh, scaled to the body's semi-axes, or one with a scale of its own
    std::optional<double> mesh_scale_m;  ///< length of one unit of the mesh [m]; empty: a unit mesh
    Eigen::Affine3d body_from_mesh = Eigen::Affine3d::Identity();  ///< places the mesh in the body's frame
    double given_size_m = 0;  ///< largest full extent in the kit; that of the body, unless it is fitted
    /// With shape = "mesh": how far the body's surface, fitted to the mesh, lies from it.
    std::optional<sim::SurfaceError> fitted;
    render::Look look;
    audio::Voice voice;
    std::vector<ZoneSound> zones;  ///< as body.zones
    double velocity_gamma = 1;     ///< loudness speed = 5 (speed / 5)^gamma [m/s]
    double tip_choke_s = 0;        ///< a stick's tip that rests on it so long ends what it rings; 0: never
    bool drawn_stand = true;       ///< a stand is drawn from the body down to the floor
    Pedal pedal{};
    std::string bus{};  ///< empty: none
};

/// The stick as the kit wants it; unset values come from the trace.
struct StickDefinition {
    double length_m = 0.40;                ///< of the drawn stick, hand to tip
    std::optional<Eigen::Vector3d> tip;    ///< in the tracked body's frame [m]
    std::optional<Eigen::Vector3d> shaft;  ///< unit, hand to tip
    double radius_m = 0.006;
    double mass_kg = 0.05;
    double young_pa = 1e10;  ///< of the tip
    std::filesystem::path mesh;
};

/// A kit file, checked and complete.
struct Kit {
    std::filesystem::path file;
    std::vector<std::filesystem::path> files;        ///< it and all that it includes, for provenance
    std::vector<std::filesystem::path> sound_files;  ///< samples, orchestras and rooms of its own, likewise
    std::string name, description;
    std::vector<Instrument> instruments;
    StickDefinition stick;
    std::vector<Bus> buses;
    audio::Mix mix;
    std::optional<render::Camera> camera;  ///< none: fitted to the instruments
    render::Room room;
};

/// Reads a kit (TOML). `defaults.toml` of the assets stands under every kit; `include` names further files,
/// relative to the kit or to the assets. Throws BadInput with FILE:LINE:COLUMN for whatever is unknown,
/// missing or out of range.
[[nodiscard]] Kit read_kit(const std::filesystem::path& file);

/// What the instruments are for the simulation, in their order.
[[nodiscard]] std::vector<sim::BodyDefinition> bodies_of(const Kit& kit);

/// Keys, ranges and defaults of kit files. The defaults of [stick], [camera] and [room] are those of the bundled
/// defaults.toml.
[[nodiscard]] FormatDescription kit_format();

/// Where the tip and the shaft lie in the tracked body's frame: an option overrides the kit, the kit the
/// trace.
struct StickGeometry {
    Eigen::Vector3d tip = Eigen::Vector3d::Zero();      ///< centre of the tip [m]
    Eigen::Vector3d shaft = -Eigen::Vector3d::UnitZ();  ///< unit, hand to tip
    double radius_m = 0.006;
    double length_m = 0.40;
};

[[nodiscard]] StickGeometry stick_geometry(const tracking::Trace& trace, const StickDefinition& stick,
                                           const std::optional<Eigen::Vector3d>& tip_option,
                                           const std::optional<Eigen::Vector3d>& shaft_option);

/// The measured path of one stick's tip.
struct TipTrack {
    std::string stick;
    std::vector<double> t_s;
    std::vector<Eigen::Vector3d> tip;  ///< [m], world
};
[[nodiscard]] TipTrack tip_track(const tracking::StickTrace& stick, const StickGeometry& geometry);

/// Those of all sticks.
[[nodiscard]] std::vector<TipTrack> tip_tracks(const tracking::Trace& trace, const StickGeometry& geometry);

}  // namespace app
