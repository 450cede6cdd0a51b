#include "object_bounds.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace render {
namespace {

constexpr float kInside = 1e-4f, kSame = 1e-3f, kMore = 1.003f;  // of the box's half size

std::vector<Eigen::Vector3f> corners_of(const Eigen::AlignedBox3f& box) {
    std::vector<Eigen::Vector3f> corners;
    for (int i = 0; i < 8; ++i)
        corners.push_back(box.corner(static_cast<Eigen::AlignedBox3f::CornerType>(i)));
    return corners;
}

/// A plane n x = height; all points have n x <= height.
struct Plane {
    Eigen::Vector3f normal;
    float height;
};

/// Across the axes, the diagonals of faces and those of the unit cube, both ways.
std::vector<Plane> planes_around(const Mesh& mesh, const Eigen::Vector3f& center,
                                 const Eigen::Vector3f& half) {
    std::vector<Plane> planes;
    for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y)
            for (int z = -1; z <= 1; ++z)
                if (x != 0 || y != 0 || z != 0)
                    planes.push_back({Eigen::Vector3i(x, y, z).cast<float>(), -4});
    for (const MeshPart& part : mesh.parts)
        for (const Eigen::Vector3f& position : part.positions) {
            const Eigen::Vector3f p = (position - center).cwiseQuotient(half);
            for (Plane& plane : planes) plane.height = std::max(plane.height, plane.normal.dot(p));
        }
    return planes;
}

/// Where three of the planes meet and no other cuts it off.
std::vector<Eigen::Vector3f> corners_of(const std::vector<Plane>& planes) {
    std::vector<Eigen::Vector3f> corners;
    const auto is_corner = [&](const Eigen::Vector3f& p) {
        return std::ranges::all_of(planes,
                                   [&](const Plane& q) { return q.normal.dot(p) <= q.height + kInside; }) &&
               std::ranges::none_of(corners,
                                    [&](const Eigen::Vector3f& c) { return (c - p).norm() < kSame; });
    };
    for (auto a = planes.begin(); a != planes.end(); ++a)
        for (auto b = a + 1; b != planes.end(); ++b)
            for (auto c = b + 1; c != planes.end(); ++c) {
                const Eigen::Vector3f bc = b->normal.cross(c->normal);
                const float determinant = a->normal.dot(bc);
                if (std::abs(determinant) < 0.5f) continue;  // of whole numbers
                const Eigen::Vector3f p = (a->height * bc + b->height * c->normal.cross(a->normal) +
                                           c->height * a->normal.cross(b->normal)) /
                                          determinant;
                if (is_corner(p)) corners.push_back(p);
            }
    return corners;
}

}  // namespace

std::vector<Eigen::Vector3f> corners_around(const Mesh& mesh) {
    const Eigen::AlignedBox3f box = mesh.bounds();
    if (box.isEmpty()) return {};
    const Eigen::Vector3f half = 0.5f * box.sizes();
    if (half.minCoeff() < 1e-4f * half.maxCoeff()) return corners_of(box);
    std::vector<Eigen::Vector3f> corners = corners_of(planes_around(mesh, box.center(), half));
    for (Eigen::Vector3f& corner : corners) corner = box.center() + kMore * corner.cwiseProduct(half);
    return corners;
}

std::vector<Eigen::Vector3f> ObjectBounds::corners_now(const FrameState& frame, std::size_t object) const {
    if (reach.empty()) return corners;
    Eigen::AlignedBox3f all = box;
    for (std::size_t k = 0; k < reach.size(); ++k) {
        const Eigen::Vector3f grown = std::abs(frame.modal[object][static_cast<Eigen::Index>(k)]) * reach[k];
        all.min() -= grown, all.max() += grown;
    }
    return corners_of(all);
}

}  // namespace render
