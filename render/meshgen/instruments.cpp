#include <cmath>
#include <numbers>

#include "shapes.h"
#include "solids.h"

namespace meshgen {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kDrumSegments = 36, kLugs = 6, kCymbalSegments = 44, kBellSegments = 30;

/// A lug of the shell and its rod up to the hoops, turned to its place around the drum.
void add_lug(Part& lug, double angle) {
    Part upright;
    lathe(upright, {{0, 0.34}, {0.030, 0.25}, {0.030, -0.25}, {0, -0.34}}, 6);
    tube(upright, {0.012, 0.99, 0}, {0.012, -0.99, 0}, {0.011, 0.011}, 4);
    Eigen::Affine3d placed(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()));
    placed.translate(Eigen::Vector3d(0.955, 0, 0));
    append_transformed(lug, upright, placed);
}

/// Height of the cymbal's upper side outside its bell.
double bow(double radius) {
    return 0.42 - 1.36 * std::pow((radius - 0.2) / 0.8, 1.5);
}

void add_hoop(Part& hoop, double top, double bottom) {
    const double middle = (top + bottom) / 2;
    lathe_ring(hoop, {{0.957, top}, {0.985, top}, {1.0, middle}, {0.985, bottom}, {0.957, bottom}},
               kDrumSegments);
}

}  // namespace

ObjMesh drum() {
    ObjMesh mesh{"drum", {}};
    lathe_with_edges(mesh.part("shell"),
                     {{{0, 0.90}, {0.94, 0.90}}, {{0.94, 0.90}, {0.94, -0.90}}, {{0.94, -0.90}, {0, -0.90}}},
                     kDrumSegments);
    for (const double top : {0.985, -0.90}) {  // a collar of film under the hoop, then the playing face
        const double bottom = top - 0.085;
        lathe_with_edges(
            mesh.part("head"),
            {{{0, top}, {0.96, top}}, {{0.96, top}, {0.96, bottom}}, {{0.96, bottom}, {0, bottom}}},
            kDrumSegments);
    }
    add_hoop(mesh.part("hoop"), 1.0, 0.80);
    add_hoop(mesh.part("hoop"), -0.80, -1.0);
    for (int i = 0; i < kLugs; ++i) add_lug(mesh.part("lug"), 2 * kPi * (i + 0.5) / kLugs);
    return mesh;
}

ObjMesh cymbal() {
    Profile top{{0, 1.0}, {0.075, 0.955}, {0.14, 0.77}, {0.185, 0.51}, {0.23, 0.42}};
    for (const double radius : {0.48, 0.74, 1.0}) top.emplace_back(radius, bow(radius));
    const Profile bottom{{1.0, -1.0}, {0.62, bow(0.62) - 0.06}, {0.21, 0.36}, {0, 0.9}};
    ObjMesh mesh{"cymbal", {}};
    lathe_with_edges(mesh.part("bronze"), {top, {top.back(), bottom.front()}, bottom}, kCymbalSegments);
    return mesh;
}

ObjMesh bell() {
    Profile outside{{0, 0.88}}, inside;
    for (int i = 1; i <= 7; ++i) {  // a dome a little taller than round, inside the unit ball
        const double angle = kPi / 2 * i / 7;
        outside.emplace_back(0.90 * std::sin(angle), 0.02 + 0.86 * std::cos(angle));
    }
    outside.emplace_back(0.91, -0.14);
    outside.emplace_back(0.945, -0.28);
    inside = {{0.905, -0.28}, {0.85, -0.10}};
    for (int i = 5; i >= 1; --i) {
        const double angle = kPi / 2 * i / 6;
        inside.emplace_back(0.82 * std::sin(angle), 0.02 + 0.78 * std::cos(angle));
    }
    inside.emplace_back(0, 0.80);
    ObjMesh mesh{"bell", {}};
    Part& metal = mesh.part("metal");
    lathe_with_edges(metal, {outside, {outside.back(), inside.front()}, inside}, kBellSegments);
    Part loop;  // upright ring on the crown
    Profile section;
    for (int i = 0; i < 6; ++i)
        section.emplace_back(0.075 + 0.025 * std::cos(kPi / 3 * i), -0.025 * std::sin(kPi / 3 * i));
    lathe_ring(loop, section, 12);
    Eigen::Affine3d upright(Eigen::Translation3d(0, 0.90, 0));
    upright.rotate(Eigen::AngleAxisd(kPi / 2, Eigen::Vector3d::UnitX()));
    append_transformed(metal, loop, upright);
    tube(metal, {0, 0.82, 0}, {0, -0.25, 0}, {0.03, 0.03}, 6);
    sphere(metal, {0, -0.30, 0}, 0.15, 10);
    return mesh;
}

ObjMesh bar() {
    ObjMesh mesh{"bar", {}};
    rounded_box(mesh.part("bar"), Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(),
                Eigen::Vector3d::Constant(0.1), 2);
    return mesh;
}

ObjMesh string() {
    ObjMesh mesh{"string", {}};
    Part upright;
    lathe_with_edges(upright, {{{0, 1}, {1, 1}}, {{1, 1}, {1, -1}}, {{1, -1}, {0, -1}}}, 12);
    const Eigen::Affine3d along_x(Eigen::AngleAxisd(-kPi / 2, Eigen::Vector3d::UnitZ()));
    append_transformed(mesh.part("string"), upright, along_x);
    return mesh;
}

ObjMesh string_frame() {
    ObjMesh mesh{"string_frame", {}};
    Part& wood = mesh.part("wood");
    rounded_box(wood, {0, -0.4, 0}, {1, 0.6, 1}, {0.04, 0.25, 0.04}, 2);
    for (const double x : {-0.9, 0.9})
        rounded_box(wood, {x, 0.55, 0}, {0.025, 0.45, 0.92}, {0.012, 0.2, 0.03}, 1);
    return mesh;
}

}  // namespace meshgen
