// A run that goes on from a saved state: every later step to the bit as without the interruption.
#include <gtest/gtest.h>

#include <random>

#include "damaged_bytes.h"
#include "shared_scenes.h"
#include "sim/distributed_world.h"
#include "sim/errors.h"

namespace {

using Bytes = std::vector<std::uint8_t>;

/// The hash of every step, the states after some of them, and what the run came to.
struct Seen : sim::DistributedObserver {
    explicit Seen(std::uint64_t save_every = 0) : every(save_every) {}
    void at(std::uint64_t step, const sim::World& world) override { hashes[step] = world.state_hash(); }
    void done(std::uint64_t step, const std::function<sim::RunState()>& state) override {
        if (every > 0 && step % every == 0) saved[step] = sim::encode(state());
    }
    std::uint64_t every;
    std::map<std::uint64_t, std::uint64_t> hashes;
    std::map<std::uint64_t, Bytes> saved;
};

/// All that a result says, but for times.
std::string text_of(const sim::DistributedResult& r) {
    std::ostringstream out;
    out.precision(17);
    const sim::WorldCounts& n = r.counts;
    for (const auto count : {n.steps, n.inverse_fallbacks, n.deformations_limited, n.constraints_broken,
                             n.impacts, n.solved_again, n.held_apart, std::uint64_t(n.contacts),
                             std::uint64_t(n.pairs), std::uint64_t(n.islands), std::uint64_t(n.asleep)})
        out << count << ' ';
    for (const sim::QuarantinedBody& q : r.quarantined) out << q.body << '@' << q.step << q.what << ' ';
    for (const auto& told : {r.limited, r.broken})
        for (const sim::FirstStep& first : told) out << first.number << '@' << first.step << ' ';
    out << r.outside_impulse.transpose() << ' ' << r.rest_reached << ' ' << r.steps;
    return out.str();
}

/// Goes on from each saved state: every later step has the bits of the undisturbed run.
void expect_same_after_resume(const sim::WorldScene& scene, std::uint64_t steps, std::uint64_t every) {
    Seen whole(every);
    const sim::DistributedResult result = run_alone(scene, world_test::for_steps(steps), whole);
    ASSERT_FALSE(whole.saved.empty());
    for (const auto& [step, bytes] : whole.saved) {
        const sim::RunState from = sim::decode_run_state(bytes, scene);
        EXPECT_EQ(sim::encode(from), bytes);
        Seen after;
        const sim::DistributedResult again = run_alone(scene, world_test::for_steps(steps), after, &from);
        for (const auto& [later, hash] : after.hashes)
            ASSERT_EQ(hash, whole.hashes.at(later)) << "from step " << step << " at " << later;
        EXPECT_EQ(after.hashes.size(), 2 + steps - step);  // the start, and from `step` on
        EXPECT_EQ(text_of(again), text_of(result)) << step;
    }
}

double between(std::mt19937& random, double low, double high) {
    return low + (high - low) * (random() / 4294967295.0);
}

/// Bodies of all kinds that fall onto each other, some joined, driven, pushed, soft beyond their limit or far too fast;
/// others come later.
sim::WorldScene random_scene(unsigned seed) {
    std::mt19937 random(seed);
    const auto vector = [&](double most) {
        return Eigen::Vector3d(between(random, -most, most), between(random, -most, most),
                               between(random, -most, most));
    };
    sim::WorldScene scene;
    scene.world = world_test::on_floor();
    scene.world.settings.substeps = 1 + int(random() % 6);
    scene.world.settings.dt = random() % 2 == 0 ? 1.0 / 60 : 1.0 / 240;
    const auto body = [&](double height) {
        const Eigen::Vector3d at(between(random, -1.5, 1.5), height, between(random, -1.5, 1.5));
        sim::WorldBody b = random() % 2 == 0 ? world_test::box(at, {0.3, 0.2, 0.4})
                                             : world_test::ball(at, sim::Fidelity::rigid, 0.3);
        b.fidelity.fidelity =
            std::array{sim::Fidelity::rigid, sim::Fidelity::linear, sim::Fidelity::modal}[random() % 3];
        b.material.young_pa = std::pow(10, between(random, 3.5, 7));
        b.restitution = random() % 3 == 0 ? 0.6 : 0;
        b.velocity = vector(random() % 5 == 0 ? 60 : 2);
        b.angular_velocity = vector(random() % 5 == 0 ? 40 : 2);
        return b;
    };
    for (int i = 0; i < 9; ++i) scene.world.bodies.push_back(body(0.5 + 0.7 * i));
    scene.world.bodies[8].motion = {{0.1, {2, 0.5, 0}, Eigen::Quaterniond::Identity()},
                                    {0.7, {-2, 0.5, 0}, Eigen::Quaterniond(0, 1, 0, 0)}};
    for (int i = 0; i < 3; ++i) {
        sim::PointConstraint c;
        c.name = "joint";
        c.body_a = i, c.body_b = i == 0 ? -1 : i + 2;
        c.point_b = i == 0 ? Eigen::Vector3d(0, 3, 0) : Eigen::Vector3d(0, 0.4, 0);
        c.joint = i == 0 ? sim::Joint::ball : i == 1 ? sim::Joint::hinge : sim::Joint::ball;
        c.stiffness = std::pow(10, between(random, 3, 6));
        if (i == 2) c.breaking_force = 800;
        scene.world.constraints.push_back(c);
    }
    scene.world.forces = {{1, vector(0.1), vector(80), true, 0.05, 0.6},
                          {4, {0, 0, 0}, vector(3), false, 0.33, 0.33}};
    if (seed % 4 == 3)
        scene.world.forces.push_back({7, {0, 0, 0}, {1e12, 0, 0}, false, 0.2, 0.2});  // taken out
    scene.later = {body(4), body(5)};
    scene.events = {{20, {0}, 0, 1, {}}, {37, {}, 1, 2, {}}};
    return scene;
}

TEST(RunState, ABusySceneGoesOnFromEverySixthStepWithTheSameBits) {
    expect_same_after_resume(world_test::busy_scene(), 60, 6);
}

TEST(RunState, RandomScenesGoOnFromEveryStepWithTheSameBits) {
    for (const unsigned seed : {1u, 2u, 3u, 4u, 5u, 6u, 7u}) {
        SCOPED_TRACE(seed);
        expect_same_after_resume(random_scene(seed), 60, 7);
        if (HasFatalFailure()) return;
    }
}

TEST(RunState, WhatSleepsGoesOnAsleepAndWakesWithItsGroup) {
    sim::WorldScene scene;
    scene.world = world_test::on_floor();
    for (int i = 0; i < 3; ++i)
        scene.world.bodies.push_back(world_test::box({0, 0.2 + 0.4 * i, 0}, {0.3, 0.2, 0.3}));
    scene.world.bodies.push_back(world_test::ball({2, 0.3, 0}, sim::Fidelity::linear, 0.3));
    scene.later = {world_test::ball({0, 3, 0}, sim::Fidelity::modal, 0.3)};
    scene.events = {{120, {}, 0, 1, {}}};
    Seen seen(110);
    (void)run_alone(scene, world_test::for_steps(130), seen);
    const sim::RunState state = sim::decode_run_state(seen.saved.at(110), scene);
    EXPECT_TRUE(state.world.bodies[0].asleep);  // or the test is none
    expect_same_after_resume(scene, 200, 25);
}

TEST(RunState, NoBytesAreReadThatNoRunOfTheSceneCanBeIn) {
    const sim::WorldScene scene = random_scene(1);
    Seen seen(30);
    (void)run_alone(scene, world_test::for_steps(30), seen);
    const Bytes good = seen.saved.at(30);
    std::mt19937 random(5);
    int refused = 0;
    constexpr int kMutations = 2000;
    for (int i = 0; i < kMutations; ++i) {
        const Bytes bad = damaged(good, random);
        try {
            const sim::RunState from = sim::decode_run_state(bad, scene);
            if (i % 16 != 0) continue;
            sim::DistributedObserver silent;  // what is accepted runs on, wherever it leads
            sim::DistributedSettings settings = world_test::for_steps(from.result.steps + 2);
            if (from.result.steps < 1000) (void)run_alone(scene, settings, silent, &from);
        } catch (const sim::InputError&) {
            ++refused;
        }
    }
    EXPECT_GT(refused, kMutations / 2);
    sim::WorldScene other = scene;
    other.world.bodies.pop_back();
    EXPECT_THROW((void)sim::decode_run_state(good, other), sim::InputError);
}

}  // namespace
