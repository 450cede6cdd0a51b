#include "crease_normals.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>

namespace render {
namespace {

/// Where more corners meet, all are averaged: each would be compared with each.
constexpr std::size_t kMostCompared = 256;

using Key = std::array<float, 3>;
Key key_of(const Eigen::Vector3f& v) {
    return {v.x() + 0.0f, v.y() + 0.0f, v.z() + 0.0f};  // one zero
}

/// A corner of a triangle: its number among all, the triangle's unit normal, the angle there [rad].
struct Corner {
    std::uint32_t index;
    Eigen::Vector3f normal;
    float angle;
};

std::vector<Corner> corners_of(const MeshPart& part) {
    std::vector<Corner> corners;
    corners.reserve(part.indices.size());
    for (std::size_t i = 0; i + 2 < part.indices.size(); i += 3) {
        std::array<Eigen::Vector3f, 3> at;
        for (std::size_t k = 0; k < 3; ++k) at[k] = part.positions[part.indices[i + k]];
        const Eigen::Vector3f normal = (at[1] - at[0]).cross(at[2] - at[0]).stableNormalized();
        for (std::size_t k = 0; k < 3; ++k) {
            const Eigen::Vector3f a = (at[(k + 1) % 3] - at[k]).stableNormalized(),
                                  b = (at[(k + 2) % 3] - at[k]).stableNormalized();
            corners.push_back(
                {static_cast<std::uint32_t>(i + k), normal, std::acos(std::clamp(a.dot(b), -1.0f, 1.0f))});
        }
    }
    return corners;
}

Eigen::Vector3f mean_around(const Corner& corner, std::span<const Corner> all, float least_cosine) {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    const bool no_area = corner.normal.squaredNorm() < 0.5f;
    for (const Corner& other : all)
        if (no_area || corner.normal.dot(other.normal) >= least_cosine) sum += other.angle * other.normal;
    const float length = sum.norm();
    if (length > 1e-6f) return sum / length;
    return no_area ? Eigen::Vector3f(Eigen::Vector3f::UnitY()) : corner.normal;
}

}  // namespace

void make_normals(MeshPart& part) {
    std::vector<Corner> corners = corners_of(part);
    MeshPart made;
    made.material = part.material;
    made.indices.resize(corners.size());
    const auto place = [&](const Corner& corner) {
        return key_of(part.positions[part.indices[corner.index]]);
    };
    std::ranges::stable_sort(corners, {}, place);
    // A little more, so that facets that meet at just this angle do not differ by roundings.
    const float crease = std::cos((kCreaseDeg + 0.5f) * std::numbers::pi_v<float> / 180);
    for (auto first = corners.begin(); first != corners.end();) {
        const auto last = std::find_if(first, corners.end(),
                                       [&](const Corner& corner) { return place(corner) != place(*first); });
        const std::span<const Corner> all(first, last);
        const std::size_t before = made.normals.size();
        const Eigen::Vector3f of_all = mean_around(all.front(), all, -2);
        for (const Corner& corner : all) {
            const Eigen::Vector3f normal =
                all.size() > kMostCompared ? of_all : mean_around(corner, all, crease);
            const auto same = std::find(made.normals.begin() + static_cast<std::ptrdiff_t>(before),
                                        made.normals.end(), normal);
            made.indices[corner.index] = static_cast<std::uint32_t>(same - made.normals.begin());
            if (same != made.normals.end()) continue;
            made.normals.push_back(normal);
            made.positions.push_back(part.positions[part.indices[corner.index]]);
        }
        first = last;
    }
    part = std::move(made);
}

}  // namespace render
