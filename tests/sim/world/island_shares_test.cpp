// Slabs of an island shared out to partners that wait for each other's messages.

#include "world/island_shares.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <vector>

namespace sim {
namespace {

/// Bodies strewn along x; contacts of neighbours, and of some with a plane.
struct Strewn {
    std::vector<IslandBlocks::Body> bodies;
    std::vector<Manifold> manifolds;
    std::vector<int> indices, local;
    IslandBlocks blocks;
    Crew crew;

    /// contacts: how far at most they reach along x, 0: by the seed, within two diameters.
    explicit Strewn(unsigned seed, double contacts = 0) {
        std::mt19937 random(seed);
        auto between = [&](double low, double high) {
            return std::uniform_real_distribution<double>(low, high)(random);
        };
        const int count = std::uniform_int_distribution<int>(100, 400)(random);
        const double length = between(1, 80), reach = contacts > 0 ? contacts : between(0.5, 1.99);
        for (int i = 0; i < count; ++i) {
            bodies.push_back({{between(0, length), between(0, 1), 0}, 1});
            local.push_back(i);
        }
        for (int a = 0; a < count; ++a) {
            for (int b = a + 1; b < count; ++b)
                if (std::abs(bodies[std::size_t(a)].place.x() - bodies[std::size_t(b)].place.x()) < reach &&
                    between(0, 1) < 0.2)
                    add(a, b);
            if (between(0, 1) < 0.3) add(a, kFirstPlane);
        }
        blocks.divide(crew, bodies, indices, manifolds, local);
    }
    void add(int a, int b) {
        indices.push_back(static_cast<int>(manifolds.size()));
        Manifold& manifold = manifolds.emplace_back();
        manifold.a = a, manifold.b = b, manifold.count = 1;
    }
};

std::vector<double> random_shares(unsigned seed) {
    std::mt19937 random(seed);
    std::vector<double> shares(std::uniform_int_distribution<std::size_t>(1, 12)(random));
    for (double& share : shares)
        share = std::max(0., std::uniform_real_distribution<double>(-0.5, 1)(random));
    if (seed % 10 == 0) std::ranges::fill(shares, 0);
    return shares;
}

TEST(IslandBlocks, SlabsAreAsThinAsContactsAllow) {
    for (unsigned seed = 0; seed < 20; ++seed)
        for (const auto& [reach, thickness] :
             {std::pair(0.7, 1.25), {1.24, 1.25}, {1.45, 1.5}, {1.7, 1.75}, {1.99, 2.}}) {
            const Strewn island(seed, reach);
            EXPECT_FALSE(island.blocks.reaches_further());
            for (std::size_t i = 0; i < island.bodies.size(); ++i)
                for (std::size_t j = 0; j < i; ++j) {
                    const auto slab = [&](std::size_t body) {
                        return std::floor(island.bodies[body].place.x() / thickness);
                    };
                    // At multiples from the origin. (Two hundred bodies and more on 80 m do have contacts of nearly that length.)
                    ASSERT_EQ(slab(i) - slab(j),
                              double(island.blocks.slab_of(i)) - double(island.blocks.slab_of(j)))
                        << reach << " " << seed;
                }
        }
}

TEST(IslandShares, EveryBodyAndBlockHasOneOwnerAndThoseOfItsSlabsSweepIt) {
    for (unsigned seed = 0; seed < 60; ++seed) {
        const Strewn island(seed);
        const std::vector<double> shares = random_shares(seed);
        const int partners = static_cast<int>(shares.size());
        std::vector<int> bodies(island.bodies.size(), 0), told(island.blocks.size(), 0),
            swept(island.blocks.size(), 0);
        for (int self = -1; self < partners; ++self) {
            IslandShares own(island.blocks);
            own.divide(self, shares, island.manifolds, island.local);
            own.each_body_of(self, [&](std::size_t body) {
                ++bodies[body];
                EXPECT_TRUE(own.has(body) && own.owner_of(body) == self);
            });
            if (self >= 0) own.each_block_of(self, [&](std::size_t block) { ++told[block]; });
            for (std::size_t b = 0; b < swept.size(); ++b) swept[b] += own.sweeps(island.blocks[b]);
            EXPECT_TRUE(self >= 0 || own.turns().empty()) << "who only listens sweeps nothing";
        }
        EXPECT_EQ(std::ranges::count(bodies, 1), std::ssize(bodies));
        ASSERT_FALSE(island.blocks.reaches_further());
        EXPECT_EQ(std::ranges::count(told, 1), std::ssize(told));
        for (const int times : swept) EXPECT_TRUE(times == 1 || times == 2);
    }
}

// All partners do their turns; who has to hear waits. In the end each slab of each partner has seen its blocks in the order of
// IslandBlocks, so the bits are those of one thread, and what is heard is what the other side had then.
TEST(IslandShares, TurnsNeverBlockEachOtherAndKeepEachSlabsOrder) {
    int waits = 0;
    for (unsigned seed = 0; seed < 200; ++seed) {
        const Strewn island(seed);
        const std::vector<double> shares = random_shares(seed + 1000);
        const int partners = static_cast<int>(shares.size());
        std::vector<std::unique_ptr<IslandShares>> all;
        for (int self = 0; self < partners; ++self) {
            all.push_back(std::make_unique<IslandShares>(island.blocks));
            all.back()->divide(self, shares, island.manifolds, island.local);
        }
        // Of each partner and slab: the blocks that it swept there so far. Messages hold that of the sender's slab at the border.
        std::vector<std::vector<std::vector<std::size_t>>> seen(
            std::size_t(partners), std::vector<std::vector<std::size_t>>(island.blocks.slabs()));
        std::map<std::pair<int, std::size_t>, std::vector<std::size_t>> messages;  // to whom, for which block
        std::vector<std::size_t> next(std::size_t(partners), 0);
        for (bool moved = true; moved;) {
            moved = false;
            for (int self = 0; self < partners; ++self) {
                const IslandShares& own = *all[std::size_t(self)];
                auto& at = next[std::size_t(self)];
                if (at == own.turns().size()) continue;
                const IslandShares::Turn& turn = own.turns()[at];
                const IslandBlocks::Block& block = island.blocks[turn.block];
                if (turn.border >= 0) {
                    const IslandShares::Border& border = own.borders()[std::size_t(turn.border)];
                    const std::size_t own_slab = turn.border == 0 ? block.slab + 1 : block.slab,
                                      their_slab = turn.border == 0 ? block.slab : block.slab + 1;
                    if (turn.tells) {
                        messages[{border.partner, turn.block}] = seen[std::size_t(self)][own_slab];
                    } else {
                        const auto heard = messages.find({self, turn.block});
                        if (heard == messages.end()) {
                            ++waits;
                            continue;
                        }
                        seen[std::size_t(self)][their_slab] = heard->second;
                    }
                }
                if (!turn.tells)
                    for (std::uint32_t s = block.slab; s < block.slab + block.slabs; ++s)
                        seen[std::size_t(self)][s].push_back(turn.block);
                ++at, moved = true;
            }
        }
        for (int self = 0; self < partners; ++self) {
            const IslandShares& own = *all[std::size_t(self)];
            ASSERT_EQ(next[std::size_t(self)], own.turns().size()) << "partner " << self << " waits for ever";
            own.each_slab_of(self, [&](std::size_t slab) {
                std::vector<std::size_t> expected;
                for (std::size_t b = 0; b < island.blocks.size(); ++b)
                    if (island.blocks[b].slab <= slab &&
                        slab < island.blocks[b].slab + island.blocks[b].slabs)
                        expected.push_back(b);
                EXPECT_EQ(seen[std::size_t(self)][slab], expected) << "slab " << slab;
            });
        }
    }
    EXPECT_GT(waits, 100) << "of partners for each other: else this shows nothing";
}

TEST(IslandShares, AGroupConcernsThoseWhoHaveABodyOfItOrASlabBesideOne) {
    for (unsigned seed = 0; seed < 60; ++seed) {
        const Strewn island(seed);
        std::vector<double> shares = random_shares(seed);
        IslandShares own(island.blocks);
        own.divide(0, shares, island.manifolds, island.local);
        std::mt19937 random(seed);
        std::uniform_int_distribution<int> any(0, static_cast<int>(island.bodies.size()) - 1);
        const std::vector<std::pair<int, int>> joined = {{any(random), any(random)}, {any(random), -1}};
        own.group(island.bodies.size(), joined);
        const auto& blocks = island.blocks;
        for (int body = 0; body < static_cast<int>(island.bodies.size()); ++body) {
            std::vector<int> group;
            if (body == joined[0].first || body == joined[0].second)
                group = {joined[0].first, joined[0].second};
            if (body == joined[1].first && group.empty()) group = {body};
            if (std::ranges::find(group, joined[1].first) != group.end()) group.push_back(joined[1].first);
            for (int partner = -1; partner < static_cast<int>(shares.size()); ++partner) {
                bool expected = false;
                for (const int of : group)
                    own.each_slab_of(partner, [&](std::size_t slab) {
                        const auto there = static_cast<long>(blocks.slab_of(std::size_t(of)));
                        expected = expected || std::abs(static_cast<long>(slab) - there) <= 1;
                    });
                EXPECT_EQ(own.concerns(std::size_t(body), partner), expected) << body << " " << partner;
            }
        }
    }
}

}  // namespace
}  // namespace sim
