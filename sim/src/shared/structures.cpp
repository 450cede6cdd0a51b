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
constexpr std::size_t kOwnPerForeign = 4;  // own bodies of a structure for each of others that touches it
constexpr double kMayMeet = 0.1;           // of the size: a body that lands turns and moves aside a little
constexpr double kFlatExponent = 0.5;      // with an exponent up to this one a side has a flat middle
constexpr double kUpright = 0.966;         // cosine of 15 degrees
constexpr double kUprightShare = 0.75;     // of the bodies of a structure with kMostStanding
constexpr int kMostAhead = 8, kOutlookSteps = 8, kLooks = 8;

struct Candidate {
    int body;
    bool own, slow, upright;
    Eigen::AlignedBox3d box;
    Eigen::AlignedBox3d path = {};  // contains the boxes of all times
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
};

Eigen::AlignedBox3d box_around(const SharedWorld& world, int body, const WorldBodyState& state) {
    const GeneralizedSuperquadric& shape = world.definition(body).shape;
    Eigen::Vector3d half = Eigen::Vector3d::Constant(world.most_radius(body));
    if (shape.bumps.empty()) {
        const Gauge gauge(shape.base);
        const Eigen::Matrix3d axes = state.orientation.toRotationMatrix().transpose();  // the world's
        for (int i = 0; i < 3; ++i) half[i] = axes.col(i).dot(gauge.support(axes.col(i)));
    }
    return {state.position - half, state.position + half};
}

/// Whether a flat body lies or stands on one of its sides.
bool is_upright(const WorldBody& body, const Eigen::Quaterniond& orientation, const Eigen::Vector3d& up) {
    const Eigen::Vector3d own_up = (orientation.conjugate() * up).cwiseAbs();
    const bool around = body.shape.base.e2 <= kFlatExponent;  // else only its ends are flat
    return (around ? own_up.maxCoeff() : own_up.y()) >= kUpright;
}

/// Whether a body's centre is in another's box: such bodies are added one after the other, each when the last
/// has fallen.
bool come_to_one_place(const SharedWorld& all, const std::vector<int>& bodies) {
    std::vector<Eigen::AlignedBox3d> boxes;
    for (const int body : bodies) boxes.push_back(box_around(all, body, all.state(body)));
    for (std::size_t i = 0; i < boxes.size(); ++i)
        for (std::size_t j = 0; j < boxes.size(); ++j)
            if (i != j && boxes[i].contains(boxes[j].center())) return true;
    return false;
}

double slow_speed(const SharedWorld& world, double size) {
    return kSlowShare * std::sqrt(world.settings().gravity.norm() * size);
}

/// Joins bodies that belong together. Bodies whose paths are further apart along x than `near` do not.
template <typename Together>
DisjointSets join(const SharedWorld& world, std::vector<Candidate>& candidates, double near,
                  const Together& together) {
    std::ranges::sort(candidates, {}, [](const Candidate& c) { return std::pair(c.path.min().x(), c.body); });
    DisjointSets sets(static_cast<std::size_t>(world.bodies()));
    for (std::size_t i = 0; i < candidates.size(); ++i)
        for (std::size_t j = i + 1; j < candidates.size(); ++j) {
            if (candidates[j].path.min().x() > candidates[i].path.max().x() + near) break;
            if (together(candidates[i], candidates[j])) sets.join(candidates[i].body, candidates[j].body);
        }
    return sets;
}

struct Found {
    std::vector<int> own;
    std::size_t all = 0, upright = 0;
    [[nodiscard]] bool is_structure() const {
        const bool stands = static_cast<double>(upright) >= kUprightShare * static_cast<double>(all);
        return own.size() >= 2 && all <= (stands ? kMostStanding : kMostInStructure);
    }
};

std::map<int, Found> by_first(DisjointSets& sets, const std::vector<Candidate>& candidates) {
    std::map<int, Found> found;
    for (const Candidate& c : candidates) {
        Found& of = found[sets.first(c.body)];
        if (c.own) of.own.push_back(c.body);
        ++of.all, of.upright += c.upright;
    }
    for (auto& [first, of] : found) std::ranges::sort(of.own);
    return found;
}

/// Whether two bodies come near each other: across gravity at the same time, along gravity at any times.
bool come_near(const Candidate& a, const Candidate& b, const Eigen::Vector3d& up, double within_s,
               double size) {
    const auto along = [&](const Eigen::AlignedBox3d& box) {
        const double middle = up.dot(box.center()), half = up.cwiseAbs().dot(box.sizes()) / 2;
        return std::pair(middle - half, middle + half);
    };
    const auto [low_a, high_a] = along(a.path);
    const auto [low_b, high_b] = along(b.path);
    if (low_a > high_b + kMayMeet * size || low_b > high_a + kMayMeet * size) return false;
    const double near = (a.slow && b.slow ? kBeside : kMayMeet) * size;
    for (int k = 0; k <= kLooks; ++k) {
        Eigen::Vector3d apart =
            b.box.center() - a.box.center() + within_s * k / kLooks * (b.velocity - a.velocity);
        apart -= up.dot(apart) * up;
        const Eigen::Vector3d gap = apart.cwiseAbs() - (a.box.sizes() + b.box.sizes()) / 2;
        if (gap.cwiseMax(0).norm() <= near) return true;
    }
    return false;
}

}  // namespace

bool is_flat(const WorldBody& body) {
    return std::min(body.shape.base.e1, body.shape.base.e2) <= kFlatExponent;
}

std::uint64_t gather_patience(int bound) {
    return static_cast<std::uint64_t>(2 * (kOutlookSteps + bound));
}

double structure_outlook(int bound, double dt) {
    return dt * (kOutlookSteps + 2 * std::min(bound, kMostAhead));
}

std::vector<std::vector<int>> structures(const SharedWorld& world, std::span<const int> bodies, double size) {
    const Eigen::Vector3d up = -world.settings().gravity.normalized();
    std::vector<Candidate> slow;
    for (const int body : bodies) {
        const WorldBodyState state = world.state(body);
        if (!(state.velocity.norm() < slow_speed(world, size)) || !state.position.allFinite()) continue;
        const WorldBody& definition = world.definition(body);
        slow.push_back({body, true, true,
                        is_flat(definition) && is_upright(definition, state.orientation, up),
                        box_around(world, body, state)});
        slow.back().path = slow.back().box;
    }
    const double beside = kBeside * size;
    DisjointSets sets = join(world, slow, beside, [beside](const Candidate& a, const Candidate& b) {
        return a.box.squaredExteriorDistance(b.box) <= beside * beside;
    });
    std::map<int, std::set<int>> touching;  // others' bodies that touch each set
    for (const CrossImpulse& c : world.cross_impulses()) touching[sets.first(c.own)].insert(c.ghost);
    std::vector<std::vector<int>> result;
    for (auto& [first, of] : by_first(sets, slow))
        if (of.is_structure() && kOwnPerForeign * touching[first].size() <= of.own.size())
            result.push_back(std::move(of.own));
    return result;
}

std::vector<std::vector<int>> flat_structures(const SharedWorld& world, std::span<const int> bodies,
                                              double size, double within_s,
                                              std::span<const OthersBody> others) {
    const Eigen::Vector3d& gravity = world.settings().gravity;
    if (gravity.isZero()) return {};
    const Eigen::Vector3d up = -gravity.normalized();
    std::vector<Candidate> flat;
    const auto add = [&](int body, bool own, bool asleep, const WorldBodyState& state) {
        const WorldBody& definition = world.definition(body);
        if (!is_flat(definition) || !state.position.allFinite() || !state.velocity.allFinite()) return;
        flat.push_back({body, own, state.velocity.norm() < slow_speed(world, size),
                        is_upright(definition, state.orientation, up), box_around(world, body, state)});
        Candidate& c = flat.back();
        c.path = c.box, c.velocity = state.velocity;
        c.path.extend(c.box.translated(within_s * state.velocity));
        if (!asleep) c.path.extend(c.box.translated(within_s * (state.velocity + within_s / 2 * gravity)));
    };
    for (const int body : bodies) add(body, true, world.asleep(body), world.state(body));
    for (const OthersBody& other : others) add(other.body, false, other.asleep, other.state);
    DisjointSets sets = join(world, flat, kMayMeet * size, [&](const Candidate& a, const Candidate& b) {
        return come_near(a, b, up, within_s, size);
    });
    std::vector<std::vector<int>> result;
    for (auto& [first, of] : by_first(sets, flat))
        if (of.is_structure()) result.push_back(std::move(of.own));
    return result;
}

SharedWorld with_later(const WorldScene& scene) {
    SharedWorld world(scene.world);
    for (const WorldBody& body : scene.later) (void)world.add_body(body);
    return world;
}

StructureFinder::StructureFinder(const WorldScene& scene, double size, double within_s)
    : size_(size), within_s_(within_s) {
    if (scene.later.empty()) return;
    const SharedWorld all = with_later(scene);
    std::vector<int> moving;
    for (int i = 0; i < all.bodies(); ++i)
        if (all.definition(i).moves()) moving.push_back(i);
    planned_ = flat_structures(all, moving, size, within_s);
    const auto first_later = static_cast<int>(scene.world.bodies.size());
    std::erase_if(planned_, [&](const std::vector<int>& some) {
        return some.back() < first_later || come_to_one_place(all, some);
    });
}

std::vector<std::vector<int>> StructureFinder::flat(const SharedWorld& world, std::span<const int> bodies,
                                                    std::span<const OthersBody> others) const {
    std::vector<std::vector<int>> found = flat_structures(world, bodies, size_, within_s_, others);
    std::ranges::copy_if(planned_, std::back_inserter(found),
                         [&](const std::vector<int>& planned) { return planned.back() >= world.bodies(); });
    return found;
}

std::vector<std::vector<int>> StructureFinder::all(const SharedWorld& world, std::span<const int> bodies,
                                                   std::span<const OthersBody> others) const {
    std::vector<std::vector<int>> found = flat(world, bodies, others);
    std::ranges::move(structures(world, bodies, size_), std::back_inserter(found));
    return found;
}

bool are_alike(const SharedWorld& world, const std::vector<std::vector<int>>& groups,
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
    for (const std::vector<int>& group : groups) {
        Range masses, lengths;
        for (const int body : group) {
            masses.add(world.rigid_mass(body).mass);
            lengths.add(world.definition(body).shape.base.semi_axes.maxCoeff());
        }
        mass.add(masses.most), length.add(lengths.most);
        if (std::ranges::any_of(group, [&](int body) { return in_structure.contains(body); })) continue;
        free_mass.add(masses.most), free_length.add(lengths.most);
    }
    return free_mass.within(kMostUnlikeMass, mass) && free_length.within(kMostUnlikeLength, length);
}

std::vector<int> joined_by(const std::vector<std::vector<int>>& structures,
                           const std::vector<std::vector<int>>& groups) {
    DisjointSets sets(groups.size());
    std::map<int, int> group_of;
    if (!structures.empty())
        for (std::size_t i = 0; i < groups.size(); ++i)
            for (const int body : groups[i]) group_of[body] = static_cast<int>(i);
    for (const std::vector<int>& bodies : structures)
        for (const int body : bodies) sets.join(group_of.at(bodies.front()), group_of.at(body));
    std::vector<int> first;
    for (std::size_t i = 0; i < groups.size(); ++i) first.push_back(sets.first(static_cast<int>(i)));
    return first;
}

}  // namespace sim
