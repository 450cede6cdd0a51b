#pragma once
#include <compare>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "sim/distributed_world.h"
#include "world/shared_world.h"

namespace sim {

/// Smoothed work of each body (World::work): its share of what a step takes.
class BodyCosts {
public:
    static constexpr double kSmoothing = 5;  ///< time constant [steps]
    explicit BodyCosts(int bodies) : cost_(static_cast<std::size_t>(bodies), -1.0) {}
    /// Adds the work of the last step, of bodies that took part in it.
    void add(const SharedWorld& world, std::span<const int> bodies);
    void forget(int body) { cost_[static_cast<std::size_t>(body)] = -1; }  ///< its smoothing starts anew
    /// Negative: unknown.
    [[nodiscard]] double of(int body) const { return cost_[static_cast<std::size_t>(body)]; }

private:
    std::vector<double> cost_;
};

/// A column of space along gravity, by whole sides in the two directions across.
struct Column {
    int x = 0, y = 0;
    auto operator<=>(const Column&) const = default;
    struct Hash {
        std::size_t operator()(const Column& column) const noexcept {
            return (static_cast<std::size_t>(static_cast<unsigned>(column.x)) << 32U ^
                    static_cast<unsigned>(column.y)) *
                   0x9e3779b97f4a7c15U;
        }
    };
};

/// Cuts space into columns along gravity. Their side is the mean diameter of the scene's bodies that move
/// [m], so that a single stack is one column. Borders are soft by a quarter of a side: a body that is nearer
/// to a border than this may belong to either column.
class Columns {
public:
    explicit Columns(const WorldScene& scene);
    [[nodiscard]] double side() const noexcept { return side_; }
    /// Gives each place a column. A place that has one keeps it until it is beyond the soft border. The
    /// others get theirs from the lowest up: a place that is above another one, within a quarter of a side
    /// across, joins that one's column if it may belong there. So no stack on a border is cut.
    void assign(std::span<const std::optional<Eigen::Vector3d>> places,
                std::vector<std::optional<Column>>& columns) const;

private:
    [[nodiscard]] Eigen::Vector2d across(const Eigen::Vector3d& place) const;
    [[nodiscard]] Column of(const Eigen::Vector3d& place, const Column& before) const;
    [[nodiscard]] bool may_be_in(const Eigen::Vector2d& at, const Column& column) const;

    double side_ = 1;
    Eigen::Vector3d up_, x_, y_;
};

/// How many bodies each worker owns in each column, as one worker knows it, and that worker's own lots. A lot
/// is all that it owns in one column; it is sold as a whole.
class Holdings {
public:
    struct Lot {
        Column column;
        std::vector<std::uint32_t> bodies;
        double cost = 0;      ///< smoothed, in any unit; negative: not all bodies' costs are known yet
        bool settled = true;  ///< at its present speed no body moves by a side within two seconds
    };
    explicit Holdings(std::uint32_t self) : self_(self) {}
    void add(const Column& column, std::uint32_t owner, int bodies);
    void add(Lot&& own);  ///< joins the lot of its column, if there is one
    [[nodiscard]] std::vector<Lot>& lots() noexcept { return lots_; }
    [[nodiscard]] const std::vector<Lot>& lots() const noexcept { return lots_; }
    /// By how much the border between the two workers becomes shorter if the other one gets the lot. Its
    /// length is counted in pairs of bodies in touching columns: at a corner a pair counts 1, at a side 2,
    /// within one column 4.
    [[nodiscard]] int border_saved(const Lot& lot, std::uint32_t other) const;
    /// Squared distance of a column from the mean of a worker's bodies, in sides; 0: it has none.
    [[nodiscard]] double distance2(const Column& column, std::uint32_t worker) const;
    void move(const Lot& lot, std::uint32_t to);
    /// Neighbours of each worker: workers with bodies in the same or touching columns.
    [[nodiscard]] std::map<std::uint32_t, std::set<std::uint32_t>> neighbours() const;

private:
    [[nodiscard]] int count(const Column& column, std::uint32_t worker) const;
    struct Sum {
        double x = 0, y = 0, bodies = 0;
    };
    std::uint32_t self_;
    std::unordered_map<Column, std::vector<std::pair<std::uint32_t, int>>, Column::Hash>
        counts_;                         // owner, bodies
    std::map<std::uint32_t, Sum> sums_;  // by worker
    std::vector<Lot> lots_;
};

/// Follows the columns of a run's bodies. Bodies that constraints tie together are in the column of their
/// mean position; so are the bodies of a structure.
class ColumnWatch {
public:
    explicit ColumnWatch(const WorldScene& scene);
    /// Mean diameter of bodies [m].
    [[nodiscard]] double side() const noexcept { return columns_.side(); }
    /// `owner`: of each body, kApplication for none. `place`: centre of a body of the world [m].
    /// `structures`: see structures.h.
    [[nodiscard]] Holdings holdings(std::uint32_t self, const SharedWorld& world,
                                    std::span<const std::uint32_t> owner, const BodyCosts& costs,
                                    const std::function<Eigen::Vector3d(int)>& place,
                                    const std::vector<std::vector<int>>& structures = {});

private:
    Columns columns_;
    std::vector<std::vector<int>> groups_;       // bodies that are tied together
    std::vector<std::optional<Column>> column_;  // of each group
};

}  // namespace sim
