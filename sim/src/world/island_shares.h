#pragma once
#include <array>
#include <span>
#include <utility>
#include <vector>

#include "world/disjoint_sets.h"
#include "world/island_blocks.h"

namespace sim {

/// Sorts them and keeps one of each.
void keep_once(std::vector<std::uint32_t>& bodies);

/// Which of an island's slabs each of several partners sweeps, and whom impacts and springs concern: a function of the island and
/// the shares alone, so the same at all. And in which order this one sweeps its blocks.
class IslandShares {
public:
    explicit IslandShares(const IslandBlocks& blocks) : blocks_(&blocks) {}
    IslandShares(const IslandShares&) = delete;
    IslandShares& operator=(const IslandShares&) = delete;

    /// Between this partner's slabs and those of the next one below or above.
    struct Border {
        int partner = -1;                        ///< none
        std::size_t block = 0;                   ///< of what crosses; both sweep it
        std::vector<std::uint32_t> own, theirs;  ///< bodies in its contacts, ascending
    };
    /// A block that is swept; of a border when what its other side tells has come, or, before, what that needs is told.
    struct Turn {
        std::size_t block;
        int border;  ///< or -1
        bool tells;
    };

    /// Gives each partner a run of slabs, of contacts as its share; all are alike if no share is above 0. self: this one's
    /// number, -1 of who only listens. all, local: as in IslandBlocks::divide.
    void divide(int self, std::span<const double> shares, const std::vector<Manifold>& all,
                const std::vector<int>& local);
    /// Notes which bodies impacts and springs join, as pairs of places in the island (-1: nothing that moves). What is joined,
    /// directly or over others, is a group; what these do to it, every partner computes that has one of its bodies, or a slab
    /// beside one.
    void group(std::size_t bodies, std::span<const std::pair<int, int>> joined);

    [[nodiscard]] int self() const noexcept { return self_; }
    [[nodiscard]] const std::array<Border, 2>& borders() const noexcept {
        return borders_;
    }  ///< below, above
    /// As IslandBlocks has it, but what has no slab in common commutes: what a neighbour waits for comes first, and what waits
    /// for a neighbour last.
    [[nodiscard]] const std::vector<Turn>& turns() const noexcept { return turns_; }
    [[nodiscard]] bool sweeps(const IslandBlocks::Block& block) const noexcept {
        return first_slab_ < last_slab_ && block.slab < last_slab_ && block.slab + block.slabs > first_slab_;
    }
    [[nodiscard]] bool has(std::size_t body) const {
        return blocks_->slab_of(body) >= first_slab_ && blocks_->slab_of(body) < last_slab_;
    }
    [[nodiscard]] int owner_of(std::size_t body) const { return owner_of_slab_[blocks_->slab_of(body)]; }
    /// Whether a partner computes what impacts and springs do to a body.
    [[nodiscard]] bool concerns(std::size_t body, int partner) const {
        return partner >= 0 && group_of_[body] >= 0 &&
               concerned_[static_cast<std::size_t>(group_of_[body]) * partners() +
                          static_cast<std::size_t>(partner)] != 0;
    }
    /// Whether this partner has anything to do with a body.
    [[nodiscard]] bool uses(std::size_t body) const;
    /// Calls visit(slab) for a partner's; none of who only listens.
    template <typename Visit>
    void each_slab_of(int partner, Visit visit) const {
        if (partner < 0) return;
        const auto p = static_cast<std::size_t>(partner);
        for (std::size_t s = cuts_[p]; s < cuts_[p + 1]; ++s) visit(s);
    }
    /// Calls visit(body) for those in a partner's slabs.
    template <typename Visit>
    void each_body_of(int partner, Visit visit) const {
        each_slab_of(partner, [&](std::size_t slab) {
            for (const std::uint32_t body : blocks_->bodies_of(slab)) visit(static_cast<std::size_t>(body));
        });
    }
    /// Calls visit(block) for those of which a partner tells; of those that two sweep one does.
    template <typename Visit>
    void each_block_of(int partner, Visit visit) const {
        if (partner < 0) return;
        const auto p = static_cast<std::size_t>(partner);
        for (std::size_t b = 0; b < blocks_->size(); ++b)
            if ((*blocks_)[b].slab >= cuts_[p] && (*blocks_)[b].slab < cuts_[p + 1]) visit(b);
    }

private:
    [[nodiscard]] std::size_t partners() const noexcept { return cuts_.size() - 1; }
    void cut(std::span<const double> shares);
    void find_border(Border& border, std::size_t own_slab, const std::vector<Manifold>& all,
                     const std::vector<int>& local) const;
    void order_turns();

    const IslandBlocks* blocks_;
    int self_ = -1;
    std::vector<std::size_t> cuts_;               // first slab of each partner, and their number
    std::size_t first_slab_ = 0, last_slab_ = 0;  // own ones
    std::vector<int> owner_of_slab_;              // which partner
    std::array<Border, 2> borders_;
    std::vector<Turn> turns_;
    std::vector<std::size_t> blocks_left_;  // without a turn yet
    DisjointSets sets_;
    std::vector<int> group_of_;            // of each body, or -1
    std::vector<std::uint8_t> concerned_;  // [group][partner]
};

}  // namespace sim
