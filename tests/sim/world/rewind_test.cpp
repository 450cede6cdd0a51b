// Rewinding a world of bodies that sleep, are woken, and are joined.
#include <gtest/gtest.h>
#include <sim/world.h>

#include "large_scenes.h"

namespace sim {
namespace {

TEST(WorldSharing, ARewoundWorldRepeatsItsStepsToTheBit) {
    const WorldDefinition scene = world_test::sleepers_and_ties();
    World alone(scene), other(scene);
    for (int step = 0; step < 150; ++step) alone.step();
    const WorldSnapshot snapshot = alone.snapshot();
    other.rewind(snapshot);
    EXPECT_EQ(other.state_hash(), alone.state_hash());
    other.step();
    other.rewind(snapshot);
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
