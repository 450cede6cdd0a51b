#include "shared/columns.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "messages/worker_messages.h"
#include "shape/generalized_surface.h"
#include "shared/initial_partition.h"
#include "shared/structures.h"

namespace sim {
namespace {

constexpr double kSoft = 0.25;  // of a side
constexpr double kSettledSeconds = 2;

struct Step {
    int x, y, weight;
};
constexpr std::array<Step, 9> kAround = {{{0, 0, 4},
                                          {-1, 0, 2},
                                          {1, 0, 2},
                                          {0, -1, 2},
                                          {0, 1, 2},
                                          {-1, -1, 1},
                                          {-1, 1, 1},
                                          {1, -1, 1},
                                          {1, 1, 1}}};

// A broken body has a column, too, until it is taken out.
int whole(double sides) {
    return static_cast<int>(std::floor(sides >= -1e9 ? std::min(sides, 1e9) : -1e9));
}

}  // namespace

void BodyCosts::add(const SharedWorld& world, std::span<const int> bodies) {
    for (const int body : bodies) {
        double& cost = cost_[static_cast<std::size_t>(body)];
        cost = cost < 0 ? world.work(body) : cost + (world.work(body) - cost) / kSmoothing;
    }
}

Columns::Columns(const WorldScene& scene) {
    double sum = 0;
    int bodies = 0;
    for (const std::vector<WorldBody>* some : {&scene.world.bodies, &scene.later})
        for (const WorldBody& body : *some)
            if (body.moves()) sum += 2 * GeneralizedSurface(body.shape).bounding_radius(), ++bodies;
    if (sum > 0) side_ = sum / bodies;
    const Eigen::Vector3d& gravity = scene.world.settings.gravity;
    up_ = gravity.isZero() ? Eigen::Vector3d::UnitY() : Eigen::Vector3d(-gravity.normalized());
    x_ = up_.unitOrthogonal();
    y_ = up_.cross(x_);
}

// The position in the two directions across gravity, in sides.
Eigen::Vector2d Columns::across(const Eigen::Vector3d& place) const {
    return Eigen::Vector2d(x_.dot(place), y_.dot(place)) / side_;
}

bool Columns::may_be_in(const Eigen::Vector2d& at, const Column& column) const {
    const Eigen::Vector2d from_middle = at - Eigen::Vector2d(column.x + 0.5, column.y + 0.5);
    return from_middle.cwiseAbs().maxCoeff() <= 0.5 + kSoft;
}

Column Columns::of(const Eigen::Vector3d& place, const Column& before) const {
    const Eigen::Vector2d at = across(place);
    return may_be_in(at, before) ? before : Column{whole(at.x()), whole(at.y())};
}

void Columns::assign(std::span<const std::optional<Eigen::Vector3d>> places,
                     std::vector<std::optional<Column>>& columns) const {
    std::vector<std::size_t> fresh, assigned;
    for (std::size_t i = 0; i < places.size(); ++i)
        if (places[i]) (columns[i] ? assigned : fresh).push_back(i);
    for (const std::size_t i : assigned) columns[i] = of(*places[i], *columns[i]);
    if (fresh.empty()) return;
    const auto height = [&](std::size_t i) {
        const double h = up_.dot(*places[i]);
        return std::pair(std::isfinite(h) ? h : -1e300, i);
    };
    std::ranges::sort(fresh, {}, height);
    // Assigned places by the column that contains them: near places are in the same or one of the eight
    // around it.
    std::unordered_map<Column, std::vector<std::size_t>, Column::Hash> over;
    const auto insert = [&](std::size_t i) {
        const Eigen::Vector2d at = across(*places[i]);
        over[{whole(at.x()), whole(at.y())}].push_back(i);
    };
    for (const std::size_t i : assigned) insert(i);
    for (const std::size_t i : fresh) {
        const Eigen::Vector2d at = across(*places[i]);
        const Column here{whole(at.x()), whole(at.y())};
        std::optional<std::size_t> under;
        for (const Step& step : kAround) {
            const auto near = over.find({here.x + step.x, here.y + step.y});
            if (near == over.end()) continue;
            for (const std::size_t j : near->second)
                if (height(j) < height(i) && (!under || height(*under) < height(j)) &&
                    (across(*places[j]) - at).norm() <= kSoft && may_be_in(at, *columns[j]))
                    under = j;
        }
        columns[i] = under ? *columns[*under] : here;
        insert(i);
    }
}

int Holdings::count(const Column& column, std::uint32_t worker) const {
    const auto owners = counts_.find(column);
    if (owners == counts_.end()) return 0;
    const auto found = std::ranges::find(owners->second, worker, &std::pair<std::uint32_t, int>::first);
    return found == owners->second.end() ? 0 : found->second;
}

void Holdings::add(const Column& column, std::uint32_t owner, int bodies) {
    auto& owners = counts_[column];
    const auto found = std::ranges::find(owners, owner, &std::pair<std::uint32_t, int>::first);
    if (found == owners.end())
        owners.emplace_back(owner, bodies);
    else
        found->second += bodies;
    Sum& sum = sums_[owner];
    sum.x += bodies * column.x, sum.y += bodies * column.y, sum.bodies += bodies;
}

void Holdings::add(Lot&& own) {
    const auto same = std::ranges::find(lots_, own.column, &Lot::column);
    if (same == lots_.end()) return lots_.push_back(std::move(own));
    same->bodies.insert(same->bodies.end(), own.bodies.begin(), own.bodies.end());
    same->cost = same->cost < 0 || own.cost < 0 ? -1 : same->cost + own.cost;
    same->settled = same->settled && own.settled;
}

int Holdings::border_saved(const Lot& lot, std::uint32_t other) const {
    const int bodies = static_cast<int>(lot.bodies.size());
    int sum = 0;
    for (const Step& step : kAround) {
        const Column column{lot.column.x + step.x, lot.column.y + step.y};
        int own = count(column, self_);
        if (column == lot.column) own -= bodies;
        sum += step.weight * (std::min(bodies, count(column, other)) - std::min(bodies, own));
    }
    return sum;
}

double Holdings::distance2(const Column& column, std::uint32_t worker) const {
    const auto found = sums_.find(worker);
    if (found == sums_.end() || found->second.bodies <= 0) return 0;
    const Sum& sum = found->second;
    return std::pow(column.x - sum.x / sum.bodies, 2) + std::pow(column.y - sum.y / sum.bodies, 2);
}

void Holdings::move(const Lot& lot, std::uint32_t to) {
    const int bodies = static_cast<int>(lot.bodies.size());
    add(lot.column, self_, -bodies), add(lot.column, to, bodies);
}

std::map<std::uint32_t, std::set<std::uint32_t>> Holdings::neighbours() const {
    std::map<std::uint32_t, std::set<std::uint32_t>> result;
    for (const auto& [column, owners] : counts_)
        for (const Step& step : kAround) {
            const auto near = counts_.find({column.x + step.x, column.y + step.y});
            if (near == counts_.end()) continue;
            for (const auto& [a, bodies] : owners)
                for (const auto& [b, others] : near->second)
                    if (a != b && bodies > 0 && others > 0) result[a].insert(b);
        }
    return result;
}

ColumnWatch::ColumnWatch(const WorldScene& scene)
    : columns_(scene), groups_(tied_groups(scene)), column_(groups_.size()) {}

Holdings ColumnWatch::holdings(std::uint32_t self, const SharedWorld& world,
                               std::span<const std::uint32_t> owner, const BodyCosts& costs,
                               const std::function<Eigen::Vector3d(int)>& place,
                               const std::vector<std::vector<int>>& structures) {
    const auto has_owner = [&](int body) {
        return body < world.bodies() && owner[static_cast<std::size_t>(body)] != kApplication;
    };
    struct Middle {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        int bodies = 0;
    };
    const std::vector<int> first = joined_by(structures, groups_);
    std::vector<Middle> middles(groups_.size());
    for (std::size_t i = 0; i < groups_.size(); ++i)
        for (const int body : groups_[i]) {
            if (!has_owner(body)) continue;
            Middle& middle = middles[static_cast<std::size_t>(first[i])];
            middle.sum += place(body), ++middle.bodies;
        }
    std::vector<std::optional<Eigen::Vector3d>> places(groups_.size());
    for (std::size_t i = 0; i < groups_.size(); ++i)
        if (middles[i].bodies > 0) places[i] = middles[i].sum / middles[i].bodies;
    columns_.assign(places, column_);
    Holdings holdings(self);
    const double fast = columns_.side() / kSettledSeconds;
    for (std::size_t i = 0; i < groups_.size(); ++i) {
        if (!places[static_cast<std::size_t>(first[i])]) continue;
        column_[i] = column_[static_cast<std::size_t>(first[i])];
        Holdings::Lot own{*column_[i], {}, 0, true};
        for (const int body : groups_[i]) {
            if (!has_owner(body)) continue;
            holdings.add(own.column, owner[static_cast<std::size_t>(body)], 1);
            if (owner[static_cast<std::size_t>(body)] != self || !world.own(body)) continue;
            own.bodies.push_back(static_cast<std::uint32_t>(body));
            const double cost = costs.of(body);
            own.cost = own.cost < 0 || cost < 0 ? -1 : own.cost + cost;
            own.settled = own.settled && world.state(body).velocity.norm() < fast;
        }
        if (!own.bodies.empty()) holdings.add(std::move(own));
    }
    return holdings;
}

}  // namespace sim
