#include "shared/structures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "shape/superquadric.h"
#include "world/disjoint_sets.h"

namespace sim {
namespace {

constexpr double kSlowShare = 0.25;        // of sqrt(g size)
constexpr double kBeside = 0.02;           // of the size
constexpr std::size_t kOwnPerForeign = 4;  // bodies of a structure for each other that touches it

struct SlowBody {
    int body;
    Eigen::AlignedBox3d box;
};

Eigen::AlignedBox3d box_around(const World& world, int body, const WorldBodyState& state) {
    const GeneralizedSuperquadric& shape = world.definition(body).shape;
    Eigen::Vector3d half = Eigen::Vector3d::Constant(world.most_radius(body));
    if (shape.bumps.empty()) {
        const Gauge gauge(shape.base);
        const Eigen::Matrix3d axes = state.orientation.toRotationMatrix().transpose();  // the world's
        for (int i = 0; i < 3; ++i) half[i] = axes.col(i).dot(gauge.support(axes.col(i)));
    }
    return {state.position - half, state.position + half};
}

}  // namespace

std::vector<std::vector<int>> structures(const World& world, std::span<const int> bodies, double size) {
    const double slow_speed = kSlowShare * std::sqrt(world.settings().gravity.norm() * size);
    std::vector<SlowBody> slow;
    for (const int body : bodies) {
        const WorldBodyState state = world.state(body);
        if (state.velocity.norm() < slow_speed && state.position.allFinite())
            slow.push_back({body, box_around(world, body, state)});
    }
    std::ranges::sort(slow, {}, [](const SlowBody& s) { return std::pair(s.box.min().x(), s.body); });
    DisjointSets sets(static_cast<std::size_t>(world.bodies()));
    const double near = kBeside * size;
    for (std::size_t i = 0; i < slow.size(); ++i)
        for (std::size_t j = i + 1; j < slow.size(); ++j) {
            if (slow[j].box.min().x() > slow[i].box.max().x() + near) break;
            if (slow[i].box.squaredExteriorDistance(slow[j].box) <= near * near)
                sets.join(slow[i].body, slow[j].body);
        }
    std::map<int, std::vector<int>> found;
    for (const SlowBody& s : slow) found[sets.first(s.body)].push_back(s.body);
    std::map<int, std::set<int>> foreign;  // that touch each
    for (const CrossImpulse& c : world.cross_impulses()) foreign[sets.first(c.own)].insert(c.ghost);
    std::vector<std::vector<int>> result;
    for (auto& [first, some] : found) {
        if (some.size() < 2 || some.size() > kMostInStructure ||
            kOwnPerForeign * foreign[first].size() > some.size())
            continue;
        std::ranges::sort(some);
        result.push_back(std::move(some));
    }
    return result;
}

bool are_alike(const World& world, const std::vector<std::vector<int>>& lots,
               const std::vector<std::vector<int>>& structures) {
    struct Range {
        double least = std::numeric_limits<double>::infinity(), most = 0;
        void add(double value) { least = std::min(least, value), most = std::max(most, value); }
        [[nodiscard]] bool within(double factor, const Range& of) const {
            return most <= factor * of.least && of.most <= factor * least;
        }
    };
    std::set<int> in_structure;
    for (const std::vector<int>& bodies : structures) in_structure.insert(bodies.begin(), bodies.end());
    Range mass, length, free_mass, free_length;
    for (const std::vector<int>& lot : lots) {
        Range masses, lengths;
        for (const int body : lot) {
            masses.add(world.rigid_mass(body).mass);
            lengths.add(world.definition(body).shape.base.semi_axes.maxCoeff());
        }
        mass.add(masses.most), length.add(lengths.most);
        if (std::ranges::any_of(lot, [&](int body) { return in_structure.contains(body); })) continue;
        free_mass.add(masses.most), free_length.add(lengths.most);
    }
    return free_mass.within(kMostUnlikeMass, mass) && free_length.within(kMostUnlikeLength, length);
}

std::vector<int> joined_by(const std::vector<std::vector<int>>& structures,
                           const std::vector<std::vector<int>>& lots) {
    DisjointSets sets(lots.size());
    std::map<int, int> lot_of;
    if (!structures.empty())
        for (std::size_t i = 0; i < lots.size(); ++i)
            for (const int body : lots[i]) lot_of[body] = static_cast<int>(i);
    for (const std::vector<int>& bodies : structures)
        for (const int body : bodies) sets.join(lot_of.at(bodies.front()), lot_of.at(body));
    std::vector<int> first;
    for (std::size_t i = 0; i < lots.size(); ++i) first.push_back(sets.first(static_cast<int>(i)));
    return first;
}

}  // namespace sim
