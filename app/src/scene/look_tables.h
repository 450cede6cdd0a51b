#pragma once
#include <render/scene.h>

#include <Eigen/Geometry>
#include <filesystem>

#include "files/toml_reader.h"

namespace app {

// Tables that kits and scenes have in common.

inline constexpr double kRoomM = 100;  ///< everything that is drawn lies within this of the origin

/// What a file should be, for messages.
struct TomlKind {
    const char* name;  ///< "a kit"
    const char* help;  ///< what to do when there is no such file
};
/// Throws BadInput: no file, a folder, a syntax error (with its place).
[[nodiscard]] toml::table parse_toml(const std::filesystem::path& file, const TomlKind& kind);

/// Keys `orientation` (quaternion w, x, y, z), then `tilt_deg` (intrinsic X-Y-Z).
[[nodiscard]] Eigen::Quaterniond read_orientation(TomlReader& reader);
/// Keys color, metallic, roughness, lathed, and no others.
[[nodiscard]] render::Appearance read_appearance(TomlReader reader);
/// Keys eye, target, vertical_fov_deg, and no others.
void read_camera(TomlReader reader, render::Camera& camera);
/// Keys floor_color, wall_color, floor_height; done() is the caller's.
void read_room(TomlReader& reader, render::Room& room);

}  // namespace app
