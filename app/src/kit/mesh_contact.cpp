#include "kit/mesh_contact.h"

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

namespace app {
namespace {

constexpr int kCellsASide = 16;
constexpr std::size_t kSurfacePoints = 60000;
constexpr double kDeepest = 0.1;  // below the convex hull, of the size

struct Facet {
    std::array<Eigen::Vector3d, 3> corners;
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< of the winding, as long as twice the area
};

std::vector<Facet> facets_of(const render::Mesh& mesh, const Eigen::Affine3d& body_from_mesh) {
    std::vector<Facet> facets;
    facets.reserve(mesh.triangles());
    for (const render::MeshPart& part : mesh.parts)
        for (std::size_t i = 0; i + 2 < part.indices.size(); i += 3) {
            Facet facet;
            for (std::size_t k = 0; k < 3; ++k)
                facet.corners[k] = body_from_mesh * part.positions[part.indices[i + k]].cast<double>();
            facet.normal = (facet.corners[1] - facet.corners[0]).cross(facet.corners[2] - facet.corners[0]);
            facets.push_back(facet);
        }
    return facets;
}

/// The outermost points by direction, in coordinates that scale the body to [-1, 1].
class OuterShell {
public:
    explicit OuterShell(const Eigen::AlignedBox3d& box)
        : middle_(box.center()), half_((0.5 * box.sizes()).cwiseMax(1e-9)) {}

    void take(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
        if (normal.dot(point - middle_) <= 0) return;
        const Eigen::Vector3d direction = (point - middle_).cwiseQuotient(half_);
        const double radius = direction.norm();
        if (radius < 1e-9) return;
        Outermost& cell = cells_[cell_of(direction)];
        if (radius > cell.radius) cell = {radius, point};
    }
    [[nodiscard]] std::vector<Eigen::Vector3d> points() const {
        std::vector<Eigen::Vector3d> points;
        for (const Outermost& cell : cells_)
            if (cell.radius > 0) points.push_back(cell.point);
        return points;
    }

private:
    struct Outermost {
        double radius = 0;
        Eigen::Vector3d point = Eigen::Vector3d::Zero();
    };
    static std::size_t cell_of(const Eigen::Vector3d& direction) {
        Eigen::Index axis = 0;
        const double longest = direction.cwiseAbs().maxCoeff(&axis);
        const auto place = [&](Eigen::Index other) {
            const double share = direction[other] / longest * 0.5 + 0.5;
            return std::min(static_cast<int>(share * kCellsASide), kCellsASide - 1);
        };
        const int face = 2 * static_cast<int>(axis) + (direction[axis] < 0 ? 1 : 0);
        const int cell = (face * kCellsASide + place((axis + 1) % 3)) * kCellsASide + place((axis + 2) % 3);
        return static_cast<std::size_t>(cell);
    }

    Eigen::Vector3d middle_, half_;
    std::vector<Outermost> cells_ = std::vector<Outermost>(6 * kCellsASide * kCellsASide);
};

/// Points evenly over the area: in a triangle by the sequence of the plastic number (Roberts 2018), folded.
void take_surface(const std::vector<Facet>& facets, OuterShell& shell) {
    double area = 0;
    for (const Facet& facet : facets) area += facet.normal.norm();
    if (!(area > 0)) return;
    double before = 0;
    std::size_t i = 0;
    for (const Facet& facet : facets) {
        before += facet.normal.norm();
        for (; static_cast<double>(i) + 0.5 < before / area * kSurfacePoints && i < kSurfacePoints; ++i) {
            double u = std::fmod(static_cast<double>(i + 1) * 0.7548776662466927, 1.0),
                   v = std::fmod(static_cast<double>(i + 1) * 0.5698402909980532, 1.0);
            if (u + v > 1) u = 1 - u, v = 1 - v;
            const auto& [a, b, c] = facet.corners;
            shell.take(a + u * (b - a) + v * (c - a), facet.normal);
        }
    }
}

/// How deep a point lies below the convex hull of all, by the planes that support it in directions which lie evenly (Fibonacci's
/// sphere): exact to some 4 % of the size.
std::vector<double> depths(const std::vector<Eigen::Vector3d>& points) {
    constexpr int kDirections = 2000;
    std::vector<double> depths(points.size(), std::numeric_limits<double>::infinity()),
        heights(points.size());
    for (int i = 0; i < kDirections; ++i) {
        const double y = 1 - (2 * i + 1.0) / kDirections, turn = i * std::numbers::pi * (3 - std::sqrt(5.0));
        const double radius = std::sqrt(1 - y * y);
        const Eigen::Vector3d direction(radius * std::cos(turn), y, radius * std::sin(turn));
        double highest = -std::numeric_limits<double>::infinity();
        for (std::size_t k = 0; k < points.size(); ++k) {
            heights[k] = direction.dot(points[k]);
            highest = std::max(highest, heights[k]);
        }
        for (std::size_t k = 0; k < points.size(); ++k) depths[k] = std::min(depths[k], highest - heights[k]);
    }
    return depths;
}

/// Whether the faces enclose a volume: each of their edges is met once each way. Corners at one place are one.
bool is_closed(const std::vector<Facet>& facets) {
    std::map<std::array<double, 3>, std::size_t> places;
    std::map<std::pair<std::size_t, std::size_t>, int>
        edges;  // times met in their own direction, less the other
    const auto place_of = [&](const Eigen::Vector3d& p) {
        return places.try_emplace({p.x(), p.y(), p.z()}, places.size()).first->second;
    };
    for (const Facet& facet : facets)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t a = place_of(facet.corners[k]), b = place_of(facet.corners[(k + 1) % 3]);
            if (a != b) edges[std::minmax(a, b)] += a < b ? 1 : -1;
        }
    return std::ranges::all_of(edges, [](const auto& edge) { return edge.second == 0; });
}

/// Six times the volume that closed faces enclose; negative: they look inwards.
double enclosed(const std::vector<Facet>& facets, const Eigen::Vector3d& middle) {
    double sum = 0;
    for (const Facet& facet : facets) sum += (facet.corners[0] - middle).dot(facet.normal);
    return sum;
}

}  // namespace

OuterSurface outer_surface(const render::Mesh& mesh, const Eigen::Affine3d& body_from_mesh) {
    std::vector<Facet> facets = facets_of(mesh, body_from_mesh);
    Eigen::AlignedBox3d box;
    for (const Facet& facet : facets)
        for (const Eigen::Vector3d& corner : facet.corners) box.extend(corner);
    OuterSurface outer;
    outer.inside_out =
        is_closed(facets) && enclosed(facets, box.center()) < -1e-6 * std::pow(box.sizes().maxCoeff(), 3);
    if (outer.inside_out)
        for (Facet& facet : facets) {
            std::swap(facet.corners[1], facet.corners[2]);
            facet.normal = -facet.normal;
        }
    OuterShell shell(box);
    for (const Facet& facet : facets)
        for (const Eigen::Vector3d& corner : facet.corners) shell.take(corner, facet.normal);
    take_surface(facets, shell);
    const std::vector<Eigen::Vector3d> all = shell.points();
    const std::vector<double> below = depths(all);
    for (std::size_t i = 0; i < all.size(); ++i) {
        if (below[i] <= kDeepest * box.sizes().maxCoeff())
            outer.points.push_back(all[i]);
        else
            outer.hollow_m = std::max(outer.hollow_m, below[i]);
    }
    return outer;
}

}  // namespace app
