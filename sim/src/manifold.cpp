#include "manifold.h"

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

}  // namespace

void choose_points(std::vector<ManifoldPoint>& candidates, float tolerance, Manifold& manifold) {
    manifold.count = 0;
    const int deepest = best(candidates, -1e30f, [](const ManifoldPoint& p) { return -p.separation; });
    if (deepest < 0) return;
    const ManifoldPoint first = candidates[static_cast<std::size_t>(deepest)];
    const float furthest_out = std::max(first.separation, 0.f) + tolerance;
    std::erase_if(candidates, [&](const ManifoldPoint& p) { return p.separation > furthest_out; });
    const float apart = tolerance / 2;
    auto keep = [&](int i) {
        manifold.points[static_cast<std::size_t>(manifold.count++)] = candidates[static_cast<std::size_t>(i)];
    };
    manifold.points[0] = first;
    manifold.count = 1;
    const int second = best(candidates, apart * apart,
                            [&](const ManifoldPoint& p) { return across(first, p).squaredNorm(); });
    if (second < 0) return;
    keep(second);
    const Eigen::Vector3f edge = across(first, manifold.points[1]);
    const float thin = apart * edge.norm();
    auto area = [&](const ManifoldPoint& p) { return first.normal.dot(edge.cross(across(first, p))); };
    const int third = best(candidates, thin, [&](const ManifoldPoint& p) { return std::abs(area(p)); });
    if (third < 0) return;
    keep(third);
    const float side = area(manifold.points[2]) > 0 ? 1.f : -1.f;
    const Eigen::Vector3f n = first.normal, p2 = across(first, manifold.points[1]),
                          p3 = across(first, manifold.points[2]);
    // Gain of area beyond each edge of the triangle (0, p2, p3), whose turn is `side`.
    const int fourth = best(candidates, thin, [&](const ManifoldPoint& p) {
        const Eigen::Vector3f x = across(first, p);
        const float gain1 = -side * n.dot(p2.cross(x));
        const float gain2 = -side * n.dot((p3 - p2).cross(x - p2));
        const float gain3 = -side * n.dot((-p3).cross(x - p3));
        return std::max(gain1, std::max(gain2, gain3));
    });
    if (fourth >= 0) keep(fourth);
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
