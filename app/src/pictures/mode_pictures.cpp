#include "pictures/mode_pictures.h"

#include <fmt/format.h>
#include <render/renderer.h>
#include <sim/surface_mesh.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "files/output_folder.h"

namespace app {
namespace {

constexpr int kSize = 320, kColumns = 6;  // pixels of a picture's sides; pictures in a row of the sheet
constexpr int kChecks = 8, kQuads = 16;   // a side of a box's face
// Of a superquadric: meridians and parallels (surface_mesh makes 64 x 36 of 4608 triangles), those in a
// check.
constexpr int kMeridians = 64, kParallels = 36, kTriangles = 2 * kMeridians * kParallels, kCheck = 4;
constexpr double kShare = 0.2, kRadius = 0.92;  // of what is drawn [m]

using Corner = std::pair<Eigen::Vector3d, Eigen::Vector3d>;  // place and normal

// Chequered by meridians and parallels, which the triangles follow.
bool is_dark(const Eigen::Vector3d& r, const Eigen::Vector3d& half_extents) {
    const Eigen::Vector3d direction = r.cwiseQuotient(half_extents).normalized();
    const double around = std::atan2(direction.z(), direction.x()) / (2 * M_PI) + 1;
    const double down = std::acos(std::clamp(direction.y(), -1.0, 1.0)) / M_PI;
    const int meridian = static_cast<int>(around * kMeridians) / kCheck;
    return (meridian + static_cast<int>(down * (kParallels + 1)) / kCheck) % 2 != 0;
}

void add_triangle(render::Mesh& mesh, const std::array<Corner, 3>& corners, bool dark) {
    render::MeshPart& part = mesh.parts[dark ? 1 : 0];
    for (const auto& [place, normal] : corners) {
        part.indices.push_back(static_cast<std::uint32_t>(part.positions.size()));
        part.positions.push_back(place.cast<float>());
        part.normals.push_back(normal.cast<float>());
    }
}

// One quad of the face towards `sign` along `axis`.
void add_quad(render::Mesh& mesh, const Eigen::Vector3d& half, int axis, double sign, int i, int j) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const auto corner = [&](int a, int b) {
        Eigen::Vector3d r;
        r[axis] = sign;
        r[u] = 2.0 * (i + a) / kQuads - 1;
        r[v] = 2.0 * (j + b) / kQuads - 1;
        return Corner(r.cwiseProduct(half), sign * Eigen::Vector3d::Unit(axis));
    };
    const bool dark = (i * kChecks / kQuads + j * kChecks / kQuads) % 2 != 0;
    const Corner a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
    const bool outward = sign > 0;
    add_triangle(mesh, outward ? std::array{a, b, c} : std::array{a, c, b}, dark);
    add_triangle(mesh, outward ? std::array{a, c, d} : std::array{a, d, c}, dark);
}

render::Mesh box_mesh(const Eigen::Vector3d& half) {
    render::Mesh mesh{{{"light", {}, {}, {}}, {"dark", {}, {}, {}}}};
    for (int axis = 0; axis < 3; ++axis)
        for (const double sign : {-1.0, 1.0})
            for (int i = 0; i < kQuads * kQuads; ++i)
                add_quad(mesh, half, axis, sign, i % kQuads, i / kQuads);
    return mesh;
}

render::Mesh superquadric_mesh(const sim::Superquadric& shape) {
    render::Mesh mesh{{{"light", {}, {}, {}}, {"dark", {}, {}, {}}}};
    const sim::SurfaceMesh surface = sim::surface_mesh({shape, {}}, kTriangles);
    for (const auto& [a, b, c] : surface.triangles) {
        const Eigen::Vector3d centre = (surface.vertices[a] + surface.vertices[b] + surface.vertices[c]) / 3;
        add_triangle(
            mesh,
            {Corner(surface.vertices[a], surface.normals[a]), Corner(surface.vertices[b], surface.normals[b]),
             Corner(surface.vertices[c], surface.normals[c])},
            is_dark(centre, shape.semi_axes));
    }
    return mesh;
}

render::ModeShapes shapes_at(const render::Mesh& mesh, const sim::ModalBasis& basis, int count) {
    render::ModeShapes shapes;
    shapes.count = count;
    for (const render::MeshPart& part : mesh.parts)
        for (const Eigen::Vector3f& r : part.positions)
            for (int k = 0; k < count; ++k) {
                const sim::Displacement u = sim::displacement_at(basis, basis.nodal.col(k), r.cast<double>());
                shapes.displacement.push_back(u.value.cast<float>());
                shapes.gradient.push_back(u.gradient.cast<float>());
            }
    return shapes;
}

// The largest displacement of mode `mode` on the surface [kg^-1/2].
float reach(const render::ModeShapes& shapes, int mode) {
    float largest = 0;
    for (std::size_t i = static_cast<std::size_t>(mode); i < shapes.displacement.size();
         i += static_cast<std::size_t>(shapes.count))
        largest = std::max(largest, shapes.displacement[i].norm());
    return largest;
}

void paste(const render::Image& picture, int column, int row, render::Image& sheet) {
    for (int y = 0; y < picture.height; ++y)
        std::copy_n(picture.rgb.begin() + static_cast<std::ptrdiff_t>(3) * y * picture.width,
                    3 * picture.width,
                    sheet.rgb.begin() +
                        static_cast<std::ptrdiff_t>(3) * ((row * kSize + y) * sheet.width + column * kSize));
}

}  // namespace

ModePictures::ModePictures(const sim::ModesRequest& request, const sim::ModalBasis& basis, int most) {
    const Eigen::Vector3d& half = request.shape.semi_axes;
    const double deformation = kShare * 2 * std::cbrt(half.prod());
    solid_.mesh = request.domain == sim::ModeDomain::box ? box_mesh(half) : superquadric_mesh(request.shape);
    solid_.modes = shapes_at(solid_.mesh, basis, std::min(most, basis.count()));
    scale_ = kRadius / (half.norm() + deformation);
    rise_ = scale_ * (half.y() + deformation);
    amplitude_.resize(solid_.modes.count);
    for (int k = 0; k < solid_.modes.count; ++k)
        amplitude_[k] = static_cast<float>(deformation) / reach(solid_.modes, k);
}

render::SceneDescription ModePictures::description() const {
    render::SceneDescription scene;
    const render::Appearance light{Eigen::Vector3f(0.75f, 0.72f, 0.62f), 0, 0.5f, 0};
    const render::Appearance dark{Eigen::Vector3f(0.13f, 0.25f, 0.42f), 0, 0.5f, 0};
    scene.objects.push_back({"body", {}, {light, {{"light", light}, {"dark", dark}}}, 0});
    scene.solids = {solid_};
    scene.camera.eye = Eigen::Vector3f(1.5f, 1.25f, 2.1f);
    scene.camera.target = Eigen::Vector3f(0, 0, 0);
    scene.camera.vertical_fov_deg = 36;
    scene.room.floor_height = static_cast<float>(-rise_ - 0.05);
    scene.width = scene.height = kSize;
    return scene;
}

render::FrameState ModePictures::frame(int mode) const {
    render::FrameState state;
    Eigen::Matrix4f matrix = Eigen::Matrix4f::Identity();
    matrix.topLeftCorner<3, 3>() *= static_cast<float>(scale_);
    state.world_from_object = {matrix};
    state.visible = {true};
    state.modal = {amplitude_[mode] * Eigen::VectorXf::Unit(amplitude_.size(), mode)};
    return state;
}

void ModePictures::write(const std::filesystem::path& folder, const std::filesystem::path& sheet) const {
    const int count = static_cast<int>(amplitude_.size());
    const int columns = std::min(count, kColumns), rows = (count + kColumns - 1) / kColumns;
    render::Image all{columns * kSize, rows * kSize, {}};
    all.rgb.resize(static_cast<std::size_t>(3) * all.width * all.height);
    render::Renderer renderer(description());
    render::Image picture;
    for (int k = 0; k < count; ++k) {
        renderer.draw(frame(k), picture);
        write_file(folder / fmt::format("{:06}.png", k + 1), render::encode_png(picture));
        paste(picture, k % kColumns, k / kColumns, all);
    }
    write_file(sheet, render::encode_png(all));
}

}  // namespace app
