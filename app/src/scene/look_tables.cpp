#include "scene/look_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>

#include "files/bad_input.h"

namespace app {
namespace fs = std::filesystem;

toml::table parse_toml(const fs::path& file, const TomlKind& kind) {
    std::error_code error;
    if (fs::is_directory(file, error))
        throw BadInput(
            fmt::format("{}: error: found a directory, expected {} (a TOML file)", file.string(), kind.name));
    if (!std::ifstream(file).good())
        throw BadInput(fmt::format("{}: error: found no readable file, expected {} (TOML); {}", file.string(),
                                   kind.name, kind.help));
    try {
        return toml::parse_file(file.string());
    } catch (const toml::parse_error& wrong) {
        std::string what(wrong.description());
        std::replace(what.begin(), what.end(), '\n', ' ');
        throw BadInput(fmt::format("{}:{}:{}: error: found a syntax error ({}), expected TOML", file.string(),
                                   wrong.source().begin.line, wrong.source().begin.column, what));
    }
}

Eigen::Quaterniond read_orientation(TomlReader& reader) {
    constexpr double degree = std::numbers::pi / 180;
    const Eigen::Vector3d euler =
        reader.vector("tilt_deg", -360, 360, Eigen::Vector3d::Zero().eval()) * degree;
    const Eigen::VectorXd q =
        reader.numbers("orientation", 4, -1.01, 1.01, Eigen::VectorXd(Eigen::Vector4d(1, 0, 0, 0)));
    if (std::abs(q.norm() - 1) > 0.01)
        reader.fail("orientation", fmt::format("a quaternion of length {:.3g}", q.norm()),
                    "a unit quaternion [w, x, y, z]");
    const Eigen::Quaterniond base = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
    return base * Eigen::AngleAxisd(euler.x(), Eigen::Vector3d::UnitX()) *
           Eigen::AngleAxisd(euler.y(), Eigen::Vector3d::UnitY()) *
           Eigen::AngleAxisd(euler.z(), Eigen::Vector3d::UnitZ());
}

render::Appearance read_appearance(TomlReader reader) {
    render::Appearance look;
    look.color = reader.vector("color", 0, 1, Eigen::Vector3d(look.color.cast<double>())).cast<float>();
    look.metallic = static_cast<float>(reader.number("metallic", 0, 1, 0));
    look.roughness = static_cast<float>(reader.number("roughness", 0.02, 1, 0.5));
    look.lathed = static_cast<float>(reader.number("lathed", 0, 1, 0));
    reader.done();
    return look;
}

void read_camera(TomlReader reader, render::Camera& camera) {
    camera.eye =
        reader.vector("eye", -kRoomM, kRoomM, Eigen::Vector3d(camera.eye.cast<double>())).cast<float>();
    camera.target =
        reader.vector("target", -kRoomM, kRoomM, Eigen::Vector3d(camera.target.cast<double>())).cast<float>();
    camera.vertical_fov_deg =
        static_cast<float>(reader.number("vertical_fov_deg", 5, 120, camera.vertical_fov_deg));
    if ((camera.eye - camera.target).norm() < 1e-3f)
        reader.fail("target", "the camera's target at its eye", "two different points");
    reader.done();
}

void read_room(TomlReader& reader, render::Room& room) {
    room.floor_color =
        reader.vector("floor_color", 0, 1, Eigen::Vector3d(room.floor_color.cast<double>())).cast<float>();
    room.wall_color =
        reader.vector("wall_color", 0, 1, Eigen::Vector3d(room.wall_color.cast<double>())).cast<float>();
    room.floor_height = static_cast<float>(reader.number("floor_height", -kRoomM, kRoomM, room.floor_height));
}

}  // namespace app
