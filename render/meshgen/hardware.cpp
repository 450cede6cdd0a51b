#include <cmath>
#include <numbers>

#include "shapes.h"
#include "solids.h"

namespace meshgen {
namespace {

constexpr double kPi = std::numbers::pi;

/// Lathed about +y with the hand end up, laid along z with the hand end towards +z.
const Eigen::Affine3d kAlongZ(Eigen::AngleAxisd(kPi / 2, Eigen::Vector3d::UnitX()));

ObjMesh beater(const char* name, const Profile& handle, double tip_radius, int tip_segments) {
    ObjMesh mesh{name, {}};
    Part upright;
    lathe(upright, handle, 16);
    append_transformed(mesh.part("wood"), upright, kAlongZ);
    Part ball;
    sphere(ball, {0, -0.40, 0}, tip_radius, tip_segments);
    append_transformed(mesh.part("tip"), ball, kAlongZ);
    return mesh;
}

void add_leg(ObjMesh& mesh, double angle) {
    const Eigen::Vector3d out(std::cos(angle), 0, std::sin(angle)), up = Eigen::Vector3d::UnitY();
    Part& metal = mesh.part("metal");
    tube(metal, 0.014 * out - 0.55 * up, 0.236 * out - 0.982 * up, {0.007, 0.007}, 6);
    tube(metal, 0.010 * out - 0.86 * up, 0.145 * out - 0.807 * up, {0.005, 0.005}, 5);
    sphere(mesh.part("rubber"), 0.236 * out - 0.986 * up, 0.014, 8);
}

}  // namespace

ObjMesh stand() {
    ObjMesh mesh{"stand", {}};
    Part& metal = mesh.part("metal");
    tube(metal, {0, 0, 0}, {0, -0.45, 0}, {0.006, 0.006}, 8);
    tube(metal, {0, -0.42, 0}, {0, -0.88, 0}, {0.0105, 0.0105}, 8);
    for (const double height : {-0.41, -0.545, -0.845}) {  // clamps
        lathe(metal,
              {{0, height + 0.02},
               {0.014, height + 0.02},
               {0.019, height + 0.012},
               {0.019, height - 0.012},
               {0.014, height - 0.02},
               {0, height - 0.02}},
              8);
    }
    lathe(metal, {{0, 0}, {0.008, -0.002}, {0.014, -0.012}, {0.014, -0.018}, {0.006, -0.03}, {0, -0.03}}, 10);
    for (int i = 0; i < 3; ++i) add_leg(mesh, 2 * kPi * (i + 0.25) / 3);
    return mesh;
}

ObjMesh stick() {
    return beater("stick",
                  {{0, 0.060},
                   {0.0042, 0.060},
                   {0.0065, 0.0575},
                   {0.0073, 0.053},
                   {0.0073, -0.235},
                   {0.0068, -0.285},
                   {0.0056, -0.335},
                   {0.0042, -0.372},
                   {0.0031, -0.391},
                   {0.0025, -0.399},
                   {0, -0.400}},
                  0.006, 14);
}

ObjMesh mallet() {
    return beater("mallet",
                  {{0, 0.060},
                   {0.0035, 0.060},
                   {0.0055, 0.0575},
                   {0.0062, 0.053},
                   {0.0060, -0.02},
                   {0.0046, -0.12},
                   {0.0044, -0.385},
                   {0.0030, -0.399},
                   {0, -0.400}},
                  0.020, 20);
}

std::vector<ObjMesh> all_shapes() {
    return {drum(), cymbal(), bell(), bar(), string(), string_frame(), stand(), stick(), mallet()};
}

}  // namespace meshgen
