#include "shared/initial_partition.h"

#include <algorithm>
#include <span>
#include <utility>

#include "world/disjoint_sets.h"

namespace sim {
namespace {

const WorldBody& body_of(const WorldScene& scene, int body) {
    const auto id = static_cast<std::size_t>(body), first = scene.world.bodies.size();
    return id < first ? scene.world.bodies[id] : scene.later[id - first];
}

struct Site {
    Column column;
    int bodies = 0;
    [[nodiscard]] std::pair<int, int> along(bool y) const {
        return y ? std::pair(column.y, column.x) : std::pair(column.x, column.y);
    }
};

// Whether a region is longer in the second direction.
bool is_deep(std::span<const Site> some) {
    const auto extent = [&](int Column::*axis) {
        const auto [least, most] =
            std::ranges::minmax(some, {}, [axis](const Site& site) { return site.column.*axis; });
        return most.column.*axis - least.column.*axis;
    };
    return extent(&Column::y) > extent(&Column::x);
}

// The place to cut at, so that the first part has about `share` of the bodies.
std::size_t cut(std::span<const Site> some, double share) {
    double all = 0, sum = 0;
    for (const Site& site : some) all += site.bodies;
    for (std::size_t i = 0; i < some.size(); ++i) {
        if (sum + some[i].bodies / 2.0 >= share * all) return i;
        sum += some[i].bodies;
    }
    return some.size();
}

void bisect(std::span<Site> some, int first, int workers, std::map<Column, int>& owner) {
    if (some.empty()) return;
    if (workers == 1) {
        for (const Site& site : some) owner[site.column] = first;
        return;
    }
    const bool deep = is_deep(some);
    std::ranges::sort(some, {}, [deep](const Site& site) { return site.along(deep); });
    const int half = workers / 2;
    const std::size_t at = cut(some, static_cast<double>(half) / workers);
    bisect(some.first(at), first, half, owner);
    bisect(some.subspan(at), first + half, workers - half, owner);
}

}  // namespace

std::vector<std::vector<int>> tied_groups(const WorldScene& scene) {
    const std::size_t bodies = scene.world.bodies.size() + scene.later.size();
    DisjointSets sets(bodies);
    auto moves = [&](int body) { return body >= 0 && body_of(scene, body).moves(); };
    for (const PointConstraint& c : scene.world.constraints) {
        if (!moves(c.body_a) || !moves(c.body_b)) continue;
        sets.join(c.body_a, c.body_b);
    }
    std::vector<std::vector<int>> groups;
    std::vector<std::size_t> group_of(bodies);
    for (int i = 0; i < static_cast<int>(bodies); ++i) {
        if (!moves(i)) continue;
        const int first = sets.first(i);
        if (first == i) group_of[static_cast<std::size_t>(i)] = groups.size(), groups.emplace_back();
        groups[group_of[static_cast<std::size_t>(first)]].push_back(i);
    }
    return groups;
}

std::vector<int> first_owners(const Columns& columns, const std::vector<std::vector<int>>& groups,
                              const std::vector<Eigen::Vector3d>& places, int workers) {
    const std::vector<std::optional<Eigen::Vector3d>> all(places.begin(), places.end());
    std::vector<std::optional<Column>> column(groups.size());
    columns.assign(all, column);
    std::map<Column, int> bodies, owner;
    for (std::size_t i = 0; i < groups.size(); ++i) bodies[*column[i]] += static_cast<int>(groups[i].size());
    std::vector<Site> sites;
    for (const auto& [where, count] : bodies) sites.push_back({where, count});
    bisect(sites, 0, workers, owner);
    std::vector<int> result;
    for (const std::optional<Column>& where : column) result.push_back(owner.at(*where));
    return result;
}

}  // namespace sim
