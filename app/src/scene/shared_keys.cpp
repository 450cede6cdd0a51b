#include "scene/shared_keys.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace app {
namespace {

void camera_keys(Fields& keys, render::Camera& camera) {
    keys.vector("eye", camera.eye, {-kRoomM, kRoomM, "m"}, "Where it is.");
    keys.vector("target", camera.target, {-kRoomM, kRoomM, "m"}, "The point in the middle of the picture.");
    keys.number("vertical_fov_deg", camera.vertical_fov_deg, {5, 120, "degrees"},
                "Angle of view from top to bottom.");
    keys.require((camera.eye - camera.target).norm() >= 1e-3f, "target", "the camera's target at its eye",
                 "two different points");
}

}  // namespace

const TableKind<render::Camera> kCamera = {{"camera", "Where the pictures are taken from."}, camera_keys};

void orientation_keys(Fields& keys, Eigen::Quaterniond& orientation) {
    Eigen::Vector3d tilt_deg(0, 0, 0);
    Eigen::Vector4d q(1, 0, 0, 0);
    keys.vector("tilt_deg", tilt_deg, {-360, 360, "degrees"},
                "Turns about the body's x, then y, then z axis, after `orientation`. A positive first number "
                "tilts a head towards the player.");
    keys.vector("orientation", q, {-1.01, 1.01}, "Unit quaternion w, x, y, z, body to world.");
    keys.require(std::abs(q.norm() - 1) <= 0.01, "orientation",
                 fmt::format("a quaternion of length {:.3g}", q.norm()), "a unit quaternion [w, x, y, z]");
    const Eigen::Vector3d euler = tilt_deg * (std::numbers::pi / 180);
    orientation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized() *
                  Eigen::AngleAxisd(euler.x(), Eigen::Vector3d::UnitX()) *
                  Eigen::AngleAxisd(euler.y(), Eigen::Vector3d::UnitY()) *
                  Eigen::AngleAxisd(euler.z(), Eigen::Vector3d::UnitZ());
}

void surface_keys(Fields& keys, render::Appearance& look) {
    keys.number("metallic", look.metallic, {0, 1}, "0 lacquer, skin, wood ... 1 metal.");
    keys.number("roughness", look.roughness, {0.02, 1}, "0.02 mirror ... 1 matt.");
    keys.number("lathed", look.lathed, {0, 1},
                "Fine grooves around the body's y axis, as on cymbals: 0 none ... 1 strong.");
}

void room_keys(Fields& keys, render::Room& room) {
    keys.vector("floor_color", room.floor_color, {0, 1}, "Linear RGB.");
    keys.vector("wall_color", room.wall_color, {0, 1}, "Linear RGB.");
    keys.number("floor_height", room.floor_height, {-kRoomM, kRoomM, "m"}, "World y of the drawn floor.");
}

void material_keys(Fields& keys, sim::Material& material) {
    keys.number("young_pa", material.young_pa, {1e2, 1e13, "Pa"}, "Young's modulus.");
    keys.number("poisson", material.poisson, {-0.9, 0.495}, "Poisson's ratio.");
    keys.number("density_kg_m3", material.density_kg_m3, {1, 1e5, "kg/m^3"}, "Density.");
}

}  // namespace app
