#include "sim/surface_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "shape/generalized_surface.h"
#include "sim/errors.h"

namespace sim {
namespace {

using Eigen::Vector3d;

constexpr double kFlatExponent = 0.5;  // below it a body has faces and edges that the grid of rays may miss
constexpr double kSamePlace = 1e-6;    // features this near to a vertex are left out, as share of the size

struct Sample {
    Vector3d point, normal;
};

// The bumped surface over the rest point r: p = r + h n. Its normal is that of the image of the tangent
// plane under I + h Dn + n grad h, with Dn = (I - n n^T) H / |grad N|.
Sample sample_over(const GeneralizedSurface& surface, const Vector3d& r) {
    const GaugeDerivatives d = surface.base().derivatives(r);
    const double slope = d.gradient.norm();
    const Vector3d n = d.gradient / slope;
    if (!surface.has_bumps()) return {r, n};
    const GeneralizedSurface::Displacement height = surface.displacement(r);
    const Vector3d t1 = n.unitOrthogonal(), t2 = n.cross(t1);
    const auto image = [&](const Vector3d& t) -> Vector3d {
        const Vector3d turn = d.hessian * t / slope;
        return t + height.value * (turn - n.dot(turn) * n) + n * height.gradient.dot(t);
    };
    const Vector3d normal = image(t1).cross(image(t2));
    const double length = normal.norm();
    return {r + height.value * n, length > 1e-12 && std::isfinite(length) ? Vector3d(normal / length) : n};
}

void add(SurfaceMesh& mesh, const Sample& sample) {
    mesh.vertices.push_back(sample.point);
    mesh.normals.push_back(sample.normal);
}

// Poles first and last, parallels from the upper pole down, each from +x towards +z.
void add_grid(SurfaceMesh& mesh, const GeneralizedSurface& surface, int meridians, int parallels) {
    const Gauge& gauge = surface.base();
    const auto over = [&](const Vector3d& direction) {
        return sample_over(surface, gauge.onto_surface(direction.cwiseProduct(gauge.semi_axes())));
    };
    add(mesh, over(Vector3d::UnitY()));
    for (int j = 1; j <= parallels; ++j) {
        const double theta = std::numbers::pi * j / (parallels + 1);
        for (int i = 0; i < meridians; ++i) {
            const double phi = 2 * std::numbers::pi * i / meridians, s = std::sin(theta);
            add(mesh, over({s * std::cos(phi), std::cos(theta), s * std::sin(phi)}));
        }
    }
    add(mesh, over(-Vector3d::UnitY()));
}

// Counter-clockwise seen from outside: along a parallel, then down.
void add_triangles(SurfaceMesh& mesh, int meridians, int parallels) {
    const auto at = [&](int j, int i) { return std::uint32_t(1 + j * meridians + i % meridians); };
    const std::uint32_t bottom = std::uint32_t(meridians * parallels + 1);
    for (int i = 0; i < meridians; ++i) {
        mesh.triangles.push_back({0, at(0, i + 1), at(0, i)});
        for (int j = 0; j + 1 < parallels; ++j) {
            mesh.triangles.push_back({at(j, i), at(j, i + 1), at(j + 1, i + 1)});
            mesh.triangles.push_back({at(j, i), at(j + 1, i + 1), at(j + 1, i)});
        }
        mesh.triangles.push_back({at(parallels - 1, i), at(parallels - 1, i + 1), bottom});
    }
}

void add_feature(SurfaceMesh& mesh, const GeneralizedSurface& surface, const Vector3d& direction) {
    const Gauge& gauge = surface.base();
    const Sample sample = sample_over(surface, gauge.onto_surface(direction.cwiseProduct(gauge.semi_axes())));
    const double same = kSamePlace * gauge.semi_axes().maxCoeff();
    for (const Vector3d& other : mesh.vertices) {
        if ((other - sample.point).norm() < same) return;
    }
    add(mesh, sample);
    ++mesh.features;
}

// The direction whose cross-section and height both reach the border of the straight prism.
Vector3d prism_border(const Gauge& gauge, double x, double y, double z) {
    const double flat = gauge.value({x * gauge.semi_axes().x(), 0, z * gauge.semi_axes().z()});
    return flat > 0 ? Vector3d(x / flat, y, z / flat) : Vector3d(x, y, z);
}

void add_edges_and_corners(SurfaceMesh& mesh, const GeneralizedSurface& surface, int meridians) {
    const Gauge& gauge = surface.base();
    if (std::min(gauge.e1(), gauge.e2()) >= kFlatExponent) return;
    for (int k = 0; k < 27; ++k) {
        const Vector3d d = Eigen::Vector3i(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1).cast<double>();
        if (d != Vector3d::Zero()) add_feature(mesh, surface, prism_border(gauge, d.x(), d.y(), d.z()));
    }
    for (int k = 0; gauge.e2() >= kFlatExponent && k < 2 * meridians; ++k) {  // the rims of a drum
        const int meridian = k / 2;
        const double phi = 2 * std::numbers::pi * meridian / meridians;
        add_feature(mesh, surface, prism_border(gauge, std::cos(phi), k % 2 ? -1 : 1, std::sin(phi)));
    }
}

}  // namespace

SurfaceMesh surface_mesh(const GeneralizedSuperquadric& shape, int triangles) {
    if (triangles < 48 || triangles > 20000)
        throw InputError("surface_mesh", std::to_string(triangles) + " triangles", "48 to 20000");
    const int parallels = std::max(4, int(std::lround(std::sqrt(triangles / 3.6))));
    const int meridians = 2 * ((triangles + 4 * parallels - 1) / (4 * parallels));
    const GeneralizedSurface surface(shape);
    SurfaceMesh mesh;
    add_grid(mesh, surface, meridians, parallels);
    add_triangles(mesh, meridians, parallels);
    add_edges_and_corners(mesh, surface, meridians);
    for (const Bump& bump : shape.bumps) {
        if (bump.height_m > 0)
            add_feature(mesh, surface, bump.direction.cwiseQuotient(surface.base().semi_axes()));
    }
    return mesh;
}

}  // namespace sim
