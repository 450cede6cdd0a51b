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
constexpr double kLiesSeconds = 2;

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

// What is not a number, of a body that is to be taken out, is somewhere, too.
int whole(double sides) {
    return static_cast<int>(std::floor(sides >= -1e9 ? std::min(sides, 1e9) : -1e9));
}

}  // namespace

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

// In sides.
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
    std::vector<std::size_t> there, standing;
    for (std::size_t i = 0; i < places.size(); ++i)
        if (places[i]) (columns[i] ? standing : there).push_back(i);
    for (const std::size_t i : standing) columns[i] = of(*places[i], *columns[i]);
    if (there.empty()) return;
    const auto height = [&](std::size_t i) {
        const double h = up_.dot(*places[i]);
        return std::pair(std::isfinite(h) ? h : -1e300, i);
    };
    std::ranges::sort(there, {}, height);
    // What stands, by the column over which its middle is: whatever is near enough is there or in one of the eight around.
    std::unordered_map<Column, std::vector<std::size_t>, Column::Hash> over;
    const auto stands = [&](std::size_t i) {
        const Eigen::Vector2d at = across(*places[i]);
        over[{whole(at.x()), whole(at.y())}].push_back(i);
    };
    for (const std::size_t i : standing) stands(i);
    for (const std::size_t i : there) {
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
        stands(i);
    }
}

int Holdings::count(const Column& column, std::uint32_t worker) const {
    const auto owners = there_.find(column);
    if (owners == there_.end()) return 0;
    const auto found = std::ranges::find(owners->second, worker, &std::pair<std::uint32_t, int>::first);
    return found == owners->second.end() ? 0 : found->second;
}

void Holdings::add(const Column& column, std::uint32_t owner, int bodies) {
    auto& owners = there_[column];
    const auto found = std::ranges::find(owners, owner, &std::pair<std::uint32_t, int>::first);
    if (found == owners.end())
        owners.emplace_back(owner, bodies);
    else
        found->second += bodies;
    Middle& middle = middles_[owner];
    middle.x += bodies * column.x, middle.y += bodies * column.y, middle.bodies += bodies;
}

void Holdings::add(Lot&& own) {
    const auto same = std::ranges::find(lots_, own.column, &Lot::column);
    if (same == lots_.end()) return lots_.push_back(std::move(own));
    same->bodies.insert(same->bodies.end(), own.bodies.begin(), own.bodies.end());
    same->cost = same->cost < 0 || own.cost < 0 ? -1 : same->cost + own.cost;
    same->lies = same->lies && own.lies;
}

int Holdings::shortens(const Lot& lot, std::uint32_t other) const {
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
    const auto found = middles_.find(worker);
    if (found == middles_.end() || found->second.bodies <= 0) return 0;
    const Middle& middle = found->second;
    return std::pow(column.x - middle.x / middle.bodies, 2) +
           std::pow(column.y - middle.y / middle.bodies, 2);
}

void Holdings::move(const Lot& lot, std::uint32_t to) {
    const int bodies = static_cast<int>(lot.bodies.size());
    add(lot.column, self_, -bodies), add(lot.column, to, bodies);
}

std::map<std::uint32_t, std::set<std::uint32_t>> Holdings::neighbours() const {
    std::map<std::uint32_t, std::set<std::uint32_t>> result;
    for (const auto& [column, owners] : there_)
        for (const Step& step : kAround) {
            const auto near = there_.find({column.x + step.x, column.y + step.y});
            if (near == there_.end()) continue;
            for (const auto& [a, bodies] : owners)
                for (const auto& [b, others] : near->second)
                    if (a != b && bodies > 0 && others > 0) result[a].insert(b);
        }
    return result;
}

ColumnWatch::ColumnWatch(const WorldScene& scene)
    : columns_(scene), lots_(joined_lots(scene)), column_(lots_.size()) {}

Holdings ColumnWatch::holdings(std::uint32_t self, const SharedWorld& world,
                               std::span<const std::uint32_t> owner, const BodyCosts& costs,
                               const std::function<Eigen::Vector3d(int)>& place,
                               const std::vector<std::vector<int>>& structures) {
    const auto there = [&](int body) {
        return body < world.bodies() && owner[static_cast<std::size_t>(body)] != kApplication;
    };
    struct Middle {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        int bodies = 0;
    };
    const std::vector<int> first = joined_by(structures, lots_);
    std::vector<Middle> middles(lots_.size());
    for (std::size_t i = 0; i < lots_.size(); ++i)
        for (const int body : lots_[i]) {
            if (!there(body)) continue;
            Middle& middle = middles[static_cast<std::size_t>(first[i])];
            middle.sum += place(body), ++middle.bodies;
        }
    std::vector<std::optional<Eigen::Vector3d>> places(lots_.size());
    for (std::size_t i = 0; i < lots_.size(); ++i)
        if (middles[i].bodies > 0) places[i] = middles[i].sum / middles[i].bodies;
    columns_.assign(places, column_);
    Holdings holdings(self);
    const double leaves = columns_.side() / kLiesSeconds;
    for (std::size_t i = 0; i < lots_.size(); ++i) {
        if (!places[static_cast<std::size_t>(first[i])]) continue;
        column_[i] = column_[static_cast<std::size_t>(first[i])];
        Holdings::Lot own{*column_[i], {}, 0, true};
        for (const int body : lots_[i]) {
            if (!there(body)) continue;
            holdings.add(own.column, owner[static_cast<std::size_t>(body)], 1);
            if (owner[static_cast<std::size_t>(body)] != self || !world.own(body)) continue;
            own.bodies.push_back(static_cast<std::uint32_t>(body));
            const double cost = costs.of(body);
            own.cost = own.cost < 0 || cost < 0 ? -1 : own.cost + cost;
            own.lies = own.lies && world.state(body).velocity.norm() < leaves;
        }
        if (!own.bodies.empty()) holdings.add(std::move(own));
    }
    return holdings;
}

}  // namespace sim
