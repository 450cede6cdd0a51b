// Steps that threads share out have the bits of one thread's, however many there are.
#include <gtest/gtest.h>

#include <atomic>
#include <numeric>
#include <stdexcept>

#include "large_scenes.h"
#include "world/island_blocks.h"
#include "world/processor_time.h"

using namespace world_test;

namespace {

constexpr int kCounts[] = {2, 3, 4, 7};

std::vector<std::uint64_t> hashes(const sim::WorldDefinition& definition, int steps, int threads,
                                  bool planned = false) {
    sim::World world(definition);
    planned ? world.plan_threads(threads) : world.use_threads(threads);
    std::vector<std::uint64_t> all;
    for (int i = 0; i < steps; ++i) {
        world.step();
        all.push_back(world.state_hash());
    }
    const Eigen::Vector3d outside = world.outside_impulse();
    for (int k = 0; k < 3; ++k) all.push_back(std::bit_cast<std::uint64_t>(outside[k]));
    const sim::WorldCounts& n = world.counts();
    for (const std::uint64_t count :
         {std::uint64_t(n.contacts), std::uint64_t(n.pairs), std::uint64_t(n.asleep), n.deformations_limited,
          n.inverse_fallbacks, n.impacts, n.solved_again})
        all.push_back(count);
    return all;
}

void expect_same_bits(const sim::WorldDefinition& definition, int steps) {
    const std::vector<std::uint64_t> one = hashes(definition, steps, 1);
    for (const int threads : kCounts)
        ASSERT_EQ(hashes(definition, steps, threads), one) << threads << " threads";
}

TEST(Threads, APileOfOneIslandHasTheBitsOfOneThread) {
    expect_same_bits(pile(), 60);
}

TEST(Threads, TwentyRandomScenesHaveTheBitsOfOneThread) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
        SCOPED_TRACE(seed);
        expect_same_bits(random_scene(seed), 12);
        if (HasFatalFailure()) return;
    }
}

/// Own bodies among ghosts, which another world tells: states, and what the two gave each other, after each step.
std::vector<std::uint64_t> hashes_among_ghosts(const sim::WorldDefinition& definition, int steps,
                                               int threads) {
    sim::World whole(definition), part(definition);
    part.use_threads(threads);
    part.share(sim::Sharing::pairs);
    std::vector<int> own, ghosts;
    for (int i = 0; i < part.bodies(); ++i) {
        const sim::WorldBody& body = definition.bodies[std::size_t(i)];
        if (!body.moves()) continue;
        const bool is_own = body.world_from_body.translation().x() < 3;
        part.set_own(i, is_own);
        part.watch(i, is_own);
        (is_own ? own : ghosts).push_back(i);
    }
    std::vector<std::uint64_t> all;
    const auto add = [&all](const auto& numbers) {
        for (const double x : numbers) all.push_back(std::bit_cast<std::uint64_t>(x));
    };
    std::size_t crossed = 0, given = 0;
    for (int step = 0; step < steps; ++step) {
        for (const int body : ghosts) part.place_ghost(body, whole.state(body), nullptr, whole.asleep(body));
        part.step(), whole.step();
        for (const int body : own) {
            const sim::WorldBodyState s = part.state(body);
            add(s.position), add(s.velocity), add(s.angular_momentum), add(s.q);
            if (const sim::StepImpulse* by_others = part.impulse(body)) {
                ++given;
                add(by_others->linear), add(by_others->angular), add(by_others->modal);
            }
        }
        for (const sim::CrossImpulse& c : part.cross_impulses()) {
            ++crossed;
            all.push_back(std::uint64_t(c.own) << 32 | std::uint32_t(c.ghost));
            add(c.linear), add(c.angular_own), add(c.angular_ghost);
            all.push_back(c.blow);
        }
    }
    EXPECT_GT(crossed, 5u * std::size_t(steps));
    EXPECT_GT(given, 5u * std::size_t(steps));
    return all;
}

TEST(Threads, AWorldAmongGhostsHasTheBitsOfOneThread) {
    const std::vector<std::uint64_t> one = hashes_among_ghosts(pile(), 40, 1);
    for (const int threads : kCounts)
        ASSERT_EQ(hashes_among_ghosts(pile(), 40, threads), one) << threads << " threads";
}

TEST(Threads, TheirNumberMayChangeInMidRun) {
    const sim::WorldDefinition definition = pile();
    sim::World world(definition);
    for (const int threads : {1, 4, 2, 1, 3}) {
        world.use_threads(threads);
        run(world, 6);
    }
    EXPECT_EQ(world.state_hash(), hashes(definition, 30, 1)[29]);
    EXPECT_THROW(world.use_threads(0), std::invalid_argument);
    EXPECT_THROW(world.use_threads(-3), std::invalid_argument);
}

TEST(Threads, ThatAreOnlyPlannedHaveTheBitsOfOneThreadAndSaveTimeWhereThereIsWorkForSeveral) {
    const sim::WorldDefinition definition = pile();
    EXPECT_EQ(hashes(definition, 20, 3, true), hashes(definition, 20, 1));
    sim::World world(definition);
    world.plan_threads(1);
    run(world, 5);
    EXPECT_EQ(world.saved_by_threads_s(), 0);
    world.plan_threads(2);
    const double start = sim::thread_processor_s();
    run(world, 40);
    const double took = sim::thread_processor_s() - start;
    EXPECT_GT(world.saved_by_threads_s(), 0.1 * took);  // of at most a half; and the clock's own time
    EXPECT_LT(world.saved_by_threads_s(), 0.9 * took);
    EXPECT_THROW(world.plan_threads(0), std::invalid_argument);
}

/// Until this thread has used so much processor time.
void work_for(double seconds) {
    for (const double start = sim::thread_processor_s(); sim::thread_processor_s() - start < seconds;)
        continue;
}

TEST(ThreadPlan, GivesEachPieceToWhomIsFreeFirst) {
    sim::Crew crew(sim::ThreadPlan(2));
    const double start = sim::thread_processor_s();
    // 4 ms for one, 1 ms each of three for the other: of 7 ms 4 remain.
    crew.each(4, 1, [](int, std::size_t at, std::size_t) { work_for(at == 0 ? 4e-3 : 1e-3); });
    const double took = sim::thread_processor_s() - start;
    EXPECT_NEAR(crew.plan()->saved_s(), 3e-3, 0.2e-3 + (took - 7e-3));  // interrupts lengthen pieces
}

TEST(ThreadPlan, WaitsForWhatAPieceNeeds) {
    sim::ThreadPlan plan(2);
    plan.begin();
    EXPECT_EQ(plan.next(), 0);
    work_for(1e-3);
    EXPECT_LT(plan.done(0), 0.5);
    EXPECT_EQ(plan.next(), 1);
    EXPECT_GE(plan.done(1, 2), 2);
    EXPECT_EQ(plan.next(), 0);
    plan.end();
    EXPECT_LT(plan.saved_s(), -1.9);  // the job lasts 2 s, one thread had done it at once
}

TEST(Crew, EachPieceIsDoneOnceByAnyNumberOfThreads) {
    for (const int threads : {1, 2, 5}) {
        sim::Crew crew(threads);
        EXPECT_EQ(crew.size(), threads);
        for (std::size_t count = 0; count < 400; ++count) {
            std::vector<int> done(count, 0);
            std::atomic<int> worst = 0;
            crew.each(count, 3, [&](int thread, std::size_t first, std::size_t last) {
                if (thread < 0 || thread >= threads) worst = 1;
                for (std::size_t i = first; i < last; ++i) ++done[i];
            });
            ASSERT_EQ(std::accumulate(done.begin(), done.end(), 0), int(count));
            ASSERT_TRUE(std::ranges::all_of(done, [](int n) { return n == 1; }));
            ASSERT_EQ(worst, 0);
        }
    }
}

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
        std::vector<int> seen(row.manifolds.size(), 0);
        std::size_t b = 0;
        blocks.run(
            alone, 1, [](std::uint32_t) { return false; },
            [&](std::uint32_t, const sim::IslandBlocks::Block& block) {
                for (const int m : blocks.manifolds_of(b++)) {
                    ++seen[std::size_t(m)];
                    for (const int body :
                         {row.manifolds[std::size_t(m)].a, row.manifolds[std::size_t(m)].b}) {
                        EXPECT_GE(blocks.slab_of(std::size_t(body)), block.slab);
                        EXPECT_LT(blocks.slab_of(std::size_t(body)), block.slab + block.slabs);
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
        for (const int threads : kCounts) EXPECT_EQ(logged(threads), one) << threads;
    }
}

}  // namespace
