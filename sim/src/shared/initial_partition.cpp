#include "shared/initial_partition.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

namespace sim {
namespace {

const WorldBody& body_of(const WorldScene& scene, int body) {
    const auto id = static_cast<std::size_t>(body), first = scene.world.bodies.size();
    return id < first ? scene.world.bodies[id] : scene.later[id - first];
}

struct Lots {
    std::vector<Eigen::Vector3d> centre;
    std::vector<int> size;
};

Eigen::Index longest_axis(const Lots& lots, std::span<const int> some) {
    Eigen::AlignedBox3d box;
    for (const int lot : some) box.extend(lots.centre[static_cast<std::size_t>(lot)]);
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    return axis;
}

// Where to cut so that the first part has about `share` of the bodies.
std::size_t cut(const Lots& lots, std::span<const int> some, double share) {
    double all = 0, sum = 0;
    for (const int lot : some) all += lots.size[static_cast<std::size_t>(lot)];
    for (std::size_t i = 0; i < some.size(); ++i) {
        const double size = lots.size[static_cast<std::size_t>(some[i])];
        if (sum + size / 2 >= share * all) return i;
        sum += size;
    }
    return some.size();
}

void bisect(const Lots& lots, std::span<int> some, int first, int workers, std::vector<int>& owner) {
    if (some.empty()) return;
    if (workers == 1) {
        for (const int lot : some) owner[static_cast<std::size_t>(lot)] = first;
        return;
    }
    const Eigen::Index axis = longest_axis(lots, some);
    auto key = [&](int lot) { return std::pair(lots.centre[static_cast<std::size_t>(lot)][axis], lot); };
    std::sort(some.begin(), some.end(), [&](int a, int b) { return key(a) < key(b); });
    const int half = workers / 2;
    const std::size_t at = cut(lots, some, static_cast<double>(half) / workers);
    bisect(lots, some.first(at), first, half, owner);
    bisect(lots, some.subspan(at), first + half, workers - half, owner);
}

}  // namespace

std::vector<std::vector<int>> joined_lots(const WorldScene& scene) {
    const std::size_t bodies = scene.world.bodies.size() + scene.later.size();
    std::vector<int> root(bodies);
    std::iota(root.begin(), root.end(), 0);
    auto find = [&root](int body) {
        while (root[static_cast<std::size_t>(body)] != body) body = root[static_cast<std::size_t>(body)];
        return body;
    };
    auto moves = [&](int body) { return body >= 0 && body_of(scene, body).moves(); };
    for (const PointConstraint& c : scene.world.constraints) {
        if (!moves(c.body_a) || !moves(c.body_b)) continue;
        const int a = find(c.body_a), b = find(c.body_b);
        root[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
    std::vector<std::vector<int>> lots;
    std::vector<std::size_t> lot_of(bodies);
    for (int i = 0; i < static_cast<int>(bodies); ++i) {
        if (!moves(i)) continue;
        const int first = find(i);
        if (first == i) lot_of[static_cast<std::size_t>(i)] = lots.size(), lots.emplace_back();
        lots[lot_of[static_cast<std::size_t>(first)]].push_back(i);
    }
    return lots;
}

std::vector<int> first_owners(const WorldScene& scene, const std::vector<std::vector<int>>& lots,
                              int workers) {
    Lots some;
    for (const std::vector<int>& lot : lots) {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (const int body : lot) sum += body_of(scene, body).world_from_body.translation();
        some.centre.push_back(sum / static_cast<double>(lot.size()));
        some.size.push_back(static_cast<int>(lot.size()));
    }
    std::vector<int> order(lots.size()), owner(lots.size(), 0);
    std::iota(order.begin(), order.end(), 0);
    bisect(some, order, 0, workers, owner);
    return owner;
}

}  // namespace sim
