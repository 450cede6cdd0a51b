#pragma once
#include <render/scene.h>
#include <sim/modal_body.h>

#include <Eigen/Geometry>

#include "files/fields.h"

namespace app {

// Keys that kits and scenes have in common.

inline constexpr double kRoomM = 100;  ///< everything that is drawn lies within this of the origin

/// Keys `orientation` (quaternion w, x, y, z), then `tilt_deg` (intrinsic X-Y-Z).
void orientation_keys(Fields& keys, Eigen::Quaterniond& orientation);
/// Keys metallic, roughness and lathed.
void surface_keys(Fields& keys, render::Appearance& look);
/// Keys floor_color, wall_color and floor_height.
void room_keys(Fields& keys, render::Room& room);
/// Keys young_pa, poisson and density_kg_m3.
void material_keys(Fields& keys, sim::Material& material);
extern const TableKind<render::Camera> kCamera;

}  // namespace app
