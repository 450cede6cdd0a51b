// The order in which an island's contacts are swept, alone and by several threads.
#include "solver/island_blocks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <vector>

namespace {

/// A row of bodies along x, each in contact with the next few; `far`: and one with all.
struct Row {
    std::vector<sim::IslandBlocks::Body> bodies;
    std::vector<sim::Manifold> manifolds;
    std::vector<int> indices, local;

    Row(int count, bool far) {
        for (int i = 0; i < count; ++i) bodies.push_back({Eigen::Vector3d(0.11 * i, 0, 0), 0.5});
        for (int a = 0; a < count; ++a)
            for (int b = a + 1; b < count; ++b)
                if (b - a < 5 || (far && a == 0 && b % 10 == 0)) {
                    sim::Manifold& m = manifolds.emplace_back();
                    m.a = a, m.b = b;
                }
        indices.resize(manifolds.size()), local.resize(bodies.size());
        std::iota(indices.begin(), indices.end(), 0), std::iota(local.begin(), local.end(), 0);
    }
};

TEST(IslandBlocks, HoldEveryContactOnceWithTheBodiesOfTheirSlabs) {
    for (const int count : {99, 100, 150, 900}) {
        const Row row(count, true);
        sim::IslandBlocks blocks;
        sim::Crew alone;
        blocks.divide(alone, row.bodies, row.indices, row.manifolds, row.local);
        if (count < 100) {
            EXPECT_EQ(blocks.size(), 1u);
        } else {
            EXPECT_GT(blocks.slabs(), 5u);
        }
        std::vector<std::size_t> slab_of(row.bodies.size());
        for (std::size_t s = 0; s < blocks.slabs(); ++s)
            for (const std::uint32_t body : blocks.bodies_of(s)) slab_of[body] = s;
        std::vector<int> seen(row.manifolds.size(), 0);
        std::size_t b = 0;
        blocks.run(
            alone, 1, [](std::uint32_t) { return false; },
            [&](std::uint32_t, const sim::IslandBlocks::Block& block) {
                for (const int m : blocks.manifolds_of(b++)) {
                    ++seen[std::size_t(m)];
                    for (const int body :
                         {row.manifolds[std::size_t(m)].a, row.manifolds[std::size_t(m)].b}) {
                        EXPECT_GE(slab_of[std::size_t(body)], block.slab);
                        EXPECT_LT(slab_of[std::size_t(body)], block.slab + block.slabs);
                    }
                }
            });
        EXPECT_TRUE(std::ranges::all_of(seen, [](int n) { return n == 1; }));
    }
}

TEST(IslandBlocks, VisitEachBodysBlocksInOneOrderOnAnyNumberOfThreads) {
    for (const bool far : {false, true}) {
        const Row row(300, far);
        sim::IslandBlocks blocks;
        sim::Crew alone;
        blocks.divide(alone, row.bodies, row.indices, row.manifolds, row.local);
        const auto logged = [&](int threads) {
            sim::Crew crew(threads);
            std::vector<std::vector<std::size_t>> log(blocks.slabs());
            const auto visit = [&](std::uint32_t phase, const sim::IslandBlocks::Block& block) {
                // Written without a lock: blocks of one slab are never visited at once.
                for (std::uint32_t s = block.slab; s < block.slab + block.slabs; ++s)
                    log[s].push_back(phase * 1000 + block.slab * 10 + block.slabs);
            };
            blocks.run(
                crew, 50, [](std::uint32_t phase) { return phase % 3 == 1; }, visit);
            return log;
        };
        const auto one = logged(1);
        for (std::size_t s = 0; s < one.size(); ++s) {
            EXPECT_TRUE(std::ranges::is_sorted(one[s], {}, [](std::size_t at) { return at / 1000; }));
            // Of a phase of bodies the slab alone, once.
            for (const std::size_t phase : {1u, 4u, 49u})
                EXPECT_EQ(std::ranges::count(one[s], phase, [](std::size_t at) { return at / 1000; }), 1);
            EXPECT_EQ(std::ranges::count(one[s], 4000 + s * 10 + 1), 1);
        }
        for (const int threads : {2, 3, 4, 7}) EXPECT_EQ(logged(threads), one) << threads;
    }
}

TEST(IslandBlocks, SlabsAreAsThinAsContactsAllow) {
    // Bodies of diameter 0.5 whose contacts reach 0.44: one and a quarter diameters are enough.
    const Row row(300, false);
    sim::IslandBlocks blocks;
    sim::Crew alone;
    blocks.divide(alone, row.bodies, row.indices, row.manifolds, row.local);
    const double length = 0.11 * 299;
    EXPECT_NEAR(double(blocks.slabs()), length / (1.25 * 0.5), 1.5);
}

}  // namespace
