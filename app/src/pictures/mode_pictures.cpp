#include "pictures/mode_pictures.h"

#include <fmt/format.h>
#include <render/renderer.h>
#include <sim/surface_mesh.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "files/output_folder.h"
#include "pictures/stage_parts.h"

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

/// The body, its modes, and what fits them into the picture.
struct ModeSolid {
    render::Solid solid;
    double scale;               ///< drawn over real lengths: what is drawn fits the picture
    double rise;                ///< half the drawn height, with room for the deformation
    Eigen::VectorXf amplitude;  ///< of each mode [m kg^1/2]
};

ModeSolid mode_solid(const sim::ModesRequest& request, const sim::ModalBasis& basis, int count) {
    const Eigen::Vector3d& half = request.shape.semi_axes;
    const double deformation = kShare * 2 * std::cbrt(half.prod());
    const double scale = kRadius / (half.norm() + deformation);
    ModeSolid drawn{{}, scale, scale * (half.y() + deformation), Eigen::VectorXf(count)};
    drawn.solid.mesh =
        request.domain == sim::ModeDomain::box ? box_mesh(half) : superquadric_mesh(request.shape);
    std::vector<Eigen::Vector3d> vertices;
    for (const render::MeshPart& part : drawn.solid.mesh.parts)
        for (const Eigen::Vector3f& r : part.positions) vertices.push_back(r.cast<double>());
    drawn.solid.modes = shapes_at(vertices, basis, count);
    for (int k = 0; k < count; ++k)
        drawn.amplitude[k] = static_cast<float>(deformation) / reach(drawn.solid.modes, k);
    return drawn;
}

render::SceneDescription description_of(const ModeSolid& drawn) {
    render::SceneDescription scene;
    const render::Appearance light{Eigen::Vector3f(0.75f, 0.72f, 0.62f), 0, 0.5f, 0};
    const render::Appearance dark{Eigen::Vector3f(0.13f, 0.25f, 0.42f), 0, 0.5f, 0};
    scene.objects.push_back({"body", {}, {light, {{"light", light}, {"dark", dark}}}, 0});
    scene.solids = {drawn.solid};
    scene.camera.eye = Eigen::Vector3f(1.5f, 1.25f, 2.1f);
    scene.camera.target = Eigen::Vector3f(0, 0, 0);
    scene.camera.vertical_fov_deg = 36;
    scene.room.floor_height = static_cast<float>(-drawn.rise - 0.05);
    scene.width = scene.height = kSize;
    return scene;
}

}  // namespace

void draw_modes(const sim::ModesRequest& request, const sim::ModalBasis& basis, int most,
                const std::filesystem::path& folder, const std::filesystem::path& sheet) {
    const int count = std::min(most, basis.count());
    const ModeSolid drawn = mode_solid(request, basis, count);
    const int columns = std::min(count, kColumns), rows = (count + kColumns - 1) / kColumns;
    render::Image all{columns * kSize, rows * kSize, {}};
    all.rgb.resize(static_cast<std::size_t>(3) * all.width * all.height);
    render::Renderer renderer(description_of(drawn));
    render::Image picture;
    for (int k = 0; k < count; ++k) {
        const Eigen::Matrix4f matrix =
            affine_matrix(drawn.scale * Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero());
        renderer.draw({{matrix}, {true}, {drawn.amplitude[k] * Eigen::VectorXf::Unit(count, k)}}, picture);
        write_file(folder / fmt::format("{:06}.png", k + 1), render::encode_png(picture));
        paste(picture, k % kColumns, k / kColumns, all);
    }
    write_file(sheet, render::encode_png(all));
}

}  // namespace app
