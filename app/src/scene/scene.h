#pragma once
#include <render/scene.h>
#include <sim/distributed_world.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace app {

struct FormatDescription;

inline constexpr double kFarM = 1000;  ///< everything of a scene lies within this of the origin

/// How a body is drawn. Bodies of one kind (copies of one table) have the same shape, material and modes.
struct BodyLook {
    render::Appearance appearance;
    std::size_t kind = 0;
};

/// A floor with four walls: x and z of its inner size and its centre [m].
struct SceneBox {
    Eigen::Vector2d size, center;
    double floor;
};

/// A scene's settings of its workers, if there are several.
struct SceneWorkers {
    bool all_to_first = false;       ///< at first one of them owns every body
    std::uint64_t balance_from = 0;  ///< [steps] no trade before
};

/// A scene file, checked and complete. Events are in order of steps, then of the file.
struct Scene : sim::WorldScene {
    std::filesystem::path file;
    std::string name, description;
    std::vector<BodyLook> looks;  ///< of all bodies
    std::optional<SceneBox> box;  ///< its planes are among the world's
    SceneWorkers workers;
    double seconds = 10;                   ///< how long it is worth looking at
    std::optional<double> accuracy;        ///< share of each body's largest extent, see sim/accuracy.h
    std::optional<render::Camera> camera;  ///< [m] of the scene, as is the room; none: fitted to the bodies
    render::Room room;
    double drawn_scale = 1;  ///< pictures show everything this much larger: the room is a few metres wide
};

/// Reads a scene (TOML, see assets/README.md). `dt_s` stands in for the file's. Throws BadInput with
/// FILE:LINE:COLUMN for whatever is unknown, missing or out of range.
[[nodiscard]] Scene read_scene(const std::filesystem::path& file, std::optional<double> dt_s = {});

/// Keys, ranges and defaults of scene files.
[[nodiscard]] FormatDescription scene_format();

/// A scene by path, or by the name of a bundled one ("human" is assets/scenes/human.toml).
[[nodiscard]] std::filesystem::path find_scene(const std::string& name_or_path);

}  // namespace app
