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

#include "shared/body_costs.h"
#include "sim/distributed_world.h"
#include "world/shared_world.h"

namespace sim {

/// A column of space along gravity, by whole sides across.
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

/// Cuts space into columns along gravity. Their side is the mean diameter of the scene's bodies that move [m],
/// so that a single stack is one column. Borders are soft by a quarter of a side: what is within that of a
/// border may belong to either.
class Columns {
public:
    explicit Columns(const WorldScene& scene);
    [[nodiscard]] double side() const noexcept { return side_; }
    /// Of places that have none yet, the lowest first: what is above another within a quarter of a side across
    /// joins that one's column, if it may belong there; so no stack on a border is cut. Those that have one
    /// keep it until they are beyond the soft border.
    void assign(std::span<const std::optional<Eigen::Vector3d>> places,
                std::vector<std::optional<Column>>& columns) const;

private:
    [[nodiscard]] Eigen::Vector2d across(const Eigen::Vector3d& place) const;
    [[nodiscard]] Column of(const Eigen::Vector3d& place, const Column& before) const;
    [[nodiscard]] bool may_be_in(const Eigen::Vector2d& at, const Column& column) const;

    double side_ = 1;
    Eigen::Vector3d up_, x_, y_;
};

/// Who has how many bodies in which column, as one worker knows it, and that worker's own lots: what it has in
/// one column, which is sold as a whole.
class Holdings {
public:
    struct Lot {
        Column column;
        std::vector<std::uint32_t> bodies;
        double cost = 0;   ///< smoothed, in any unit; negative: not all are known yet
        bool lies = true;  ///< no body goes as far as a side within two seconds, as fast as it is
    };
    explicit Holdings(std::uint32_t self) : self_(self) {}
    void add(const Column& column, std::uint32_t owner, int bodies);
    void add(Lot&& own);  ///< joins what is there of the column
    [[nodiscard]] std::vector<Lot>& lots() noexcept { return lots_; }
    [[nodiscard]] const std::vector<Lot>& lots() const noexcept { return lots_; }
    /// By how much the border between the two becomes shorter if the lot is the other's: pairs of bodies side by
    /// side, a column's corner counts half a side, what stands in one column double.
    [[nodiscard]] int shortens(const Lot& lot, std::uint32_t other) const;
    /// Square of the distance of a column from the middle of a worker's, in sides; 0: it has none.
    [[nodiscard]] double distance2(const Column& column, std::uint32_t worker) const;
    void move(const Lot& lot, std::uint32_t to);
    /// Of each worker those with whom it has columns in common, or that touch.
    [[nodiscard]] std::map<std::uint32_t, std::set<std::uint32_t>> neighbours() const;

private:
    [[nodiscard]] int count(const Column& column, std::uint32_t worker) const;
    struct Middle {
        double x = 0, y = 0, bodies = 0;
    };
    std::uint32_t self_;
    std::unordered_map<Column, std::vector<std::pair<std::uint32_t, int>>, Column::Hash>
        there_;  // owner, bodies
    std::map<std::uint32_t, Middle> middles_;
    std::vector<Lot> lots_;
};

/// The columns of a run's bodies, followed. Bodies that constraints tie together are in the column of their
/// middle, and so are those of a structure.
class ColumnWatch {
public:
    explicit ColumnWatch(const WorldScene& scene);
    /// Mean diameter of bodies [m].
    [[nodiscard]] double side() const noexcept { return columns_.side(); }
    /// `owner`: of each body, kApplication for none; `place`: centre of a body of the world [m]; `structures`: see there.
    [[nodiscard]] Holdings holdings(std::uint32_t self, const SharedWorld& world,
                                    std::span<const std::uint32_t> owner, const BodyCosts& costs,
                                    const std::function<Eigen::Vector3d(int)>& place,
                                    const std::vector<std::vector<int>>& structures = {});

private:
    Columns columns_;
    std::vector<std::vector<int>> lots_;         // tied together
    std::vector<std::optional<Column>> column_;  // of each
};

}  // namespace sim
