#include "workers/teams.h"

#include <gtest/gtest.h>

#include "shared_scenes.h"

// What members who check each other may cost, without processes.
namespace sim {
namespace {

TEST(Teams, AMemberOfWhoseStatesTooManyWaitIsGivenUpAndTheOthersGoOn) {
    world_test::Record record;
    DistributedSettings settings;
    settings.steps = 1'000'000;
    Coordinator meeting(world_test::busy_scene(), settings, record);
    Teams teams(meeting, 3, record);
    const std::uint32_t ahead = teams.join({}).value();
    for (int i = 0; i < 2; ++i) (void)teams.join({});
    teams.start();
    (void)teams.outgoing();
    std::uint64_t step = 0;
    while (step < 200'000 && teams.is_member(ahead))
        teams.take(ahead, encode({0, 0, ++step}, StateMessage{}));
    EXPECT_GT(step, 50'000u) << "a fast one may be far ahead";
    EXPECT_FALSE(teams.is_member(ahead));
    EXPECT_EQ(teams.members(), 2u);
    DistributedResult result;
    teams.count(result);
    EXPECT_EQ(result.lost, 1);
    EXPECT_EQ(meeting.members().size(), 1u);
}

}  // namespace
}  // namespace sim
