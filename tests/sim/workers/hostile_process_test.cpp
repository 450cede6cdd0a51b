// A hostile member in another process than the run's: the command as a user starts it, and this test, which joins it.
#include <gtest/gtest.h>

#include "hostile_member.h"
#include "processes.h"
#include "simulate_command.h"

namespace {

using namespace sim_test;

TEST(SharedWorldProcess, AProcessThatJoinsAndRepublishesOldStatesIsGivenUpAndTheRunEndsWhole) {
    const std::string endpoint = free_endpoint();
    SimulateCommand run("benchmark25 --steps 200 --workers 1 --balance off --expect 2 --listen " + endpoint);
    run.wait_until_listening();
    const HostileMember hostile(endpoint, HostileMember::Habit::republishes, 20);
    const SimulateCommand::Ended ended = run.wait();
    EXPECT_EQ(ended.status, 0) << ended.text;
    EXPECT_NE(ended.text.find("25 bodies (0 rigid, 0 linear, 25 modal), 200 steps"), std::string::npos)
        << ended.text;
    EXPECT_NE(ended.text.find("1 worker lost, 0 left"), std::string::npos) << ended.text;
    EXPECT_TRUE(comes_true([&] { return hostile.given_up(); }));
}

}  // namespace
