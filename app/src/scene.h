#pragma once
#include <render/scene.h>
#include <sim/world.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace app {

/// How a body is drawn. Bodies of one kind (copies of one table) have the same shape, material and modes.
struct BodyLook {
    render::Appearance appearance;
    std::size_t kind = 0;
};

/// A worker that is to do every step `factor` times slower.
struct Slowing {
    int worker = 0;
    double factor = 1;
};

/// A floor with four walls: x and z of its inner size and its centre [m].
struct SceneBox {
    Eigen::Vector2d size, center;
    double floor;
};

/// What happens before a step: constraints go, bodies come, a worker slows down.
struct SceneEvent {
    std::uint64_t step = 0;          ///< before this one, counted from 0
    std::vector<int> removed;        ///< constraints, as in world.constraints
    std::size_t first = 0, end = 0;  ///< bodies that come: of `later`
    std::optional<Slowing> slowing;
};

/// A scene file, checked and complete. Bodies are numbered as in the world: those of `world`, then `later` in
/// the order in which they come.
struct Scene {
    std::filesystem::path file;
    std::string name, description;
    sim::WorldDefinition world;
    std::vector<sim::WorldBody> later;
    std::vector<BodyLook> looks;     ///< of all bodies
    std::vector<SceneEvent> events;  ///< in order of steps, then of the file
    std::optional<SceneBox> box;     ///< its planes are among the world's
    double seconds = 10;             ///< how long it is worth looking at
    render::Camera camera;           ///< [m] of the scene, as is the room
    render::Room room;
    double drawn_scale = 1;  ///< pictures show everything this much larger: the room is a few metres wide
};

/// Reads a scene (TOML, see assets/README.md). `dt_s` stands in for the file's. Throws BadInput with
/// FILE:LINE:COLUMN for whatever is unknown, missing or out of range.
[[nodiscard]] Scene read_scene(const std::filesystem::path& file, std::optional<double> dt_s = {});

/// A scene by path, or by the name of a bundled one ("human" is assets/scenes/human.toml).
[[nodiscard]] std::filesystem::path find_scene(const std::string& name_or_path);

}  // namespace app
