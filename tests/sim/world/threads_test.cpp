// Steps that threads share out have the bits of one thread's, however many there are.
#include <gtest/gtest.h>

#include <stdexcept>

#include "large_scenes.h"
#include "world/shared_world.h"

using namespace world_test;

namespace {

constexpr int kCounts[] = {2, 3, 4, 7};
#ifdef MUSICWORLD_SANITIZED  // some twenty times as slow
constexpr int kSteps = 12;
#else
constexpr int kSteps = 60;
#endif

std::vector<std::uint64_t> hashes(const sim::WorldDefinition& definition, int steps, int threads) {
    sim::World world(definition);
    world.use_threads(threads);
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
    expect_same_bits(pile(), kSteps);
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
    sim::World whole(definition);
    sim::SharedWorld part(definition);
    part.use_threads(threads);
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
            all.push_back(c.rebound);
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

}  // namespace
