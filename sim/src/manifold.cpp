#include "manifold.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

// Index of the largest score above `least`, -1 if none; the first of equals.
template <typename Score>
int best(const std::vector<ManifoldPoint>& points, float least, Score score) {
    int found = -1;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const float value = score(points[i]);
        if (value > least) least = value, found = static_cast<int>(i);
    }
    return found;
}

Eigen::Vector3f across(const ManifoldPoint& from, const ManifoldPoint& to) {
    const Eigen::Vector3f d = to.arm_a - from.arm_a;
    return d - d.dot(from.normal) * from.normal;
}

float favour(const ManifoldPoint& p) {
    return p.held ? 1.2f : 1.f;
}

void mark_held(const Manifold& before, std::vector<ManifoldPoint>& candidates) {
    for (ManifoldPoint& point : candidates)
        for (int i = 0; i < before.count; ++i)
            point.held |= before.points[static_cast<std::size_t>(i)].feature == point.feature;
}

// The point that adds most length or area to those chosen, of those with separations to `out`; -1 if none
// adds more than `apart` of width.
int next_point(const std::vector<ManifoldPoint>& candidates, float out, float apart, const Manifold& chosen) {
    const ManifoldPoint& first = chosen.points[0];
    const Eigen::Vector3f& n = first.normal;
    auto among = [&](const ManifoldPoint& p, float gain) {
        return p.separation > out ? 0 : favour(p) * gain;
    };
    if (chosen.count == 1)
        return best(candidates, apart,
                    [&](const ManifoldPoint& p) { return among(p, across(first, p).norm()); });
    const Eigen::Vector3f second = across(first, chosen.points[1]);
    const float thin = apart * second.norm();
    if (chosen.count == 2)
        return best(candidates, thin, [&](const ManifoldPoint& p) {
            return among(p, std::abs(n.dot(second.cross(across(first, p)))));
        });
    // Area beyond each edge of the triangle (0, second, third).
    const Eigen::Vector3f third = across(first, chosen.points[2]);
    const float side = n.dot(second.cross(third)) > 0 ? -1.f : 1.f;
    return best(candidates, thin, [&](const ManifoldPoint& p) {
        const Eigen::Vector3f x = across(first, p);
        const float beyond =
            std::max({n.dot(second.cross(x)) * side, n.dot((third - second).cross(x - second)) * side,
                      n.dot((-third).cross(x - third)) * side});
        return among(p, beyond);
    });
}

}  // namespace

void choose_points(std::vector<ManifoldPoint>& candidates, float tolerance, const Manifold* before,
                   Manifold& manifold) {
    manifold.count = 0;
    if (before) mark_held(*before, candidates);
    const int deepest = best(candidates, -1e30f, [&](const ManifoldPoint& p) {
        return -p.separation + (p.held ? tolerance / 8 : 0);
    });
    if (deepest < 0) return;
    manifold.points[0] = candidates[static_cast<std::size_t>(deepest)];
    manifold.count = 1;
    const float level = std::max(manifold.points[0].separation, 0.f);
    std::erase_if(candidates, [&](const ManifoldPoint& p) { return p.separation > level + tolerance; });
    for (const float out : {level + tolerance / 16, level + tolerance})
        while (manifold.count < kManifoldPoints) {
            const int next = next_point(candidates, out, tolerance / 2, manifold);
            if (next < 0) break;
            manifold.points[static_cast<std::size_t>(manifold.count++)] =
                candidates[static_cast<std::size_t>(next)];
        }
}

void take_impulses(const Manifold& before, float reach, Manifold& manifold) {
    std::array<bool, kManifoldPoints> used{}, matched{};
    auto take = [&](int i, int j) {
        ManifoldPoint& to = manifold.points[static_cast<std::size_t>(i)];
        const ManifoldPoint& from = before.points[static_cast<std::size_t>(j)];
        to.normal_impulse = from.normal_impulse;
        to.friction_impulse = from.friction_impulse;
        used[static_cast<std::size_t>(j)] = matched[static_cast<std::size_t>(i)] = true;
    };
    for (int i = 0; i < manifold.count; ++i)
        for (int j = 0; j < before.count; ++j)
            if (manifold.points[static_cast<std::size_t>(i)].feature ==
                before.points[static_cast<std::size_t>(j)].feature)
                take(i, j);
    for (int i = 0; i < manifold.count; ++i) {
        if (matched[static_cast<std::size_t>(i)]) continue;
        int nearest = -1;
        float distance = reach * reach;
        for (int j = 0; j < before.count; ++j) {
            if (used[static_cast<std::size_t>(j)]) continue;
            const float d = (manifold.points[static_cast<std::size_t>(i)].arm_a -
                             before.points[static_cast<std::size_t>(j)].arm_a)
                                .squaredNorm();
            if (d < distance) distance = d, nearest = j;
        }
        if (nearest >= 0) take(i, nearest);
    }
}

}  // namespace sim
