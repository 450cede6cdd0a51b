#include <gtest/gtest.h>
#include <sim/world.h>

#include <numeric>

#include "falling_bodies.h"
#include "world_bodies.h"

// Several worlds of the same bodies, each of which owns some.

namespace sim {
namespace {

// Piles, sleepers that are woken, constraints that tie and break, in one small box.
WorldDefinition busy_scene() {
    WorldDefinition d;
    d.settings.sleep_speed = 0.1;
    d.planes.push_back({Eigen::Vector3d::UnitY(), 0, 0.5, 0});
    auto add = [&d](const Eigen::Vector3d& at, const Eigen::Vector3d& velocity, Fidelity fidelity,
                    double restitution) {
        WorldBody body;
        body.name = "body " + std::to_string(d.bodies.size());
        body.shape.base.semi_axes = Eigen::Vector3d(0.5, 0.4, 0.45);
        body.shape.base.e1 = body.shape.base.e2 = 0.3;
        body.material = {1e6, 0.3, 300};
        body.fidelity.fidelity = fidelity;
        body.fidelity.modes = 12;
        body.triangles = 180;
        body.restitution = restitution;
        body.damping_alpha = 0.5;
        body.world_from_body.translation() = at;
        body.velocity = velocity;
        d.bodies.push_back(body);
    };
    // Two piles apart, and one body that comes down on the second when most of both sleep.
    for (int i = 0; i < 4; ++i) add({0.3 * (i % 2), 0.5 + 0.9 * i, 0}, {0, 0, 0}, Fidelity::modal, 0);
    for (int i = 0; i < 4; ++i)
        add({4 + 0.3 * (i % 2), 0.5 + 0.9 * i, 0.2}, {0, 0, 0}, i % 2 ? Fidelity::linear : Fidelity::rigid,
            0.3);
    add({50, 0.5, 0.1}, {-24, 45, 0}, Fidelity::modal, 0.5);
    add({1, 6, 3}, {0, 0, 0}, Fidelity::modal, 0);
    add({1, 7, 3}, {0, 0, 0}, Fidelity::modal, 0);
    PointConstraint hanging;
    hanging.name = "hanging";
    hanging.body_a = 9, hanging.point_a = {0, 0.4, 0}, hanging.point_b = {1, 6.4, 3};
    hanging.stiffness = 2e4, hanging.breaking_force = 3000;
    d.constraints.push_back(hanging);
    PointConstraint tied;
    tied.name = "tied";
    tied.body_a = 9, tied.point_a = {0.5, 0, 0}, tied.body_b = 10, tied.point_b = {0.5, 0, 0};
    tied.stiffness = 1e4;
    d.constraints.push_back(tied);
    return d;
}

// As workers do in lockstep: everyone steps, then takes over what the others publish.
class Shares {
public:
    Shares(const WorldDefinition& definition, int worlds) {
        for (int i = 0; i < worlds; ++i) {
            World& world = worlds_.emplace_back(definition);
            world.share(Sharing::islands);
            for (int b = 0; b < world.bodies(); ++b) world.set_own(b, b % worlds == i);
        }
    }
    void own(int body, std::size_t by) {
        for (std::size_t i = 0; i < worlds_.size(); ++i) worlds_[i].set_own(body, i == by);
    }
    void step() {
        std::vector<WorldRecord> bodies;
        std::vector<std::vector<ContactRecord>> contacts(worlds_.size());
        std::vector<SpringRecord> springs, own_springs;
        for (std::size_t i = 0; i < worlds_.size(); ++i) {
            World& world = worlds_[i];
            world.step();
            for (int b = 0; b < world.bodies(); ++b)
                if (world.own(b)) bodies.push_back(world.record(b));
            world.contact_records(contacts[i]);
            world.spring_records(own_springs);
            springs.insert(springs.end(), own_springs.begin(), own_springs.end());
        }
        for (std::size_t i = 0; i < worlds_.size(); ++i) {
            std::vector<ContactRecord> others;
            for (std::size_t j = 0; j < worlds_.size(); ++j)
                if (j != i) others.insert(others.end(), contacts[j].begin(), contacts[j].end());
            std::sort(others.begin(), others.end(),
                      [](const auto& a, const auto& b) { return std::pair(a.a, a.b) < std::pair(b.a, b.b); });
            for (const WorldRecord& record : bodies)
                if (!worlds_[i].own(record.body)) worlds_[i].restore(record);
            worlds_[i].restore_contacts(others, springs);
        }
    }
    World& operator[](std::size_t i) { return worlds_[i]; }
    [[nodiscard]] std::size_t size() const { return worlds_.size(); }

private:
    std::vector<World> worlds_;
};

TEST(WorldSharing, LockstepWith1To7WorldsHasTheBitsOfOneWorldThroughPilesSleepWakingAndBreaking) {
    const WorldDefinition scene = busy_scene();
    World alone(scene);
    std::vector<std::uint64_t> hashes;
    int slept = 0, woke = 0;
    for (int step = 0; step < 700; ++step) {
        alone.step();
        hashes.push_back(alone.state_hash());
        woke += alone.counts().asleep < slept;
        slept = std::max(slept, alone.counts().asleep);
    }
    EXPECT_GE(slept, 4);
    EXPECT_GT(woke, 0);
    EXPECT_GT(alone.counts().constraints_broken, 0u);
    for (const int worlds : {1, 2, 3, 7}) {
        Shares shares(scene, worlds);
        for (int step = 0; step < 700; ++step) {
            // Bodies change hands all the time.
            if (step % 3 == 2) shares.own(step % 11, static_cast<std::size_t>(step / 3 % worlds));
            shares.step();
            for (std::size_t i = 0; i < shares.size(); ++i)
                ASSERT_EQ(shares[i].state_hash(), hashes[static_cast<std::size_t>(step)])
                    << worlds << " worlds, world " << i << ", step " << step;
        }
    }
}

TEST(WorldSharing, ARewoundWorldThatOwnsMoreRepeatsTheStepToTheBit) {
    const WorldDefinition scene = busy_scene();
    World alone(scene), other(scene);
    for (int step = 0; step < 150; ++step) alone.step();
    other.share(Sharing::islands);
    const WorldSnapshot snapshot = alone.snapshot();
    for (int b = 0; b < other.bodies(); ++b) other.set_own(b, b < 3);
    other.rewind(snapshot);
    EXPECT_EQ(other.state_hash(), alone.state_hash());
    other.step();  // its three
    other.rewind(snapshot);
    for (int b = 0; b < other.bodies(); ++b) other.set_own(b, true);
    for (int step = 0; step < 100; ++step) {
        alone.step();
        other.step();
        ASSERT_EQ(other.state_hash(), alone.state_hash()) << step;
    }
    EXPECT_EQ(other.counts().steps, alone.counts().steps);
    const auto after = [](const std::vector<FirstStep>& all) {
        std::vector<std::pair<int, std::uint64_t>> late;
        for (const FirstStep& first : all)
            if (first.step > 150) late.emplace_back(first.number, first.step);
        return late;
    };
    EXPECT_EQ(after(other.broken()), after(alone.broken())) << "what was undone is told once";
}

}  // namespace
}  // namespace sim
