#include "commands/worker_options.h"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "files/bad_input.h"

namespace app {
namespace {

/// What `simulate` makes of these words.
std::optional<WorkerOptions> options_of(std::vector<std::string> words) {
    CLI::App tree("test");
    Command command(tree);
    std::optional<WorkerOptions> options;
    add_worker_options(command, options);
    command.runs([] {});
    std::reverse(words.begin(), words.end());
    tree.parse(words);
    return options;
}

TEST(WorkerOptions, WhatMakesNoSenseTogetherIsRefusedInOneLine) {
    const std::vector<std::pair<std::vector<std::string>, const char*>> cases = {
        {{"--workers", "-1"}, "--workers -1"},
        {{"--workers", "257"}, "0 to 256"},
        {{"--bound", "3"}, "--bound 3"},
        {{"--bound", "65"}, "0 to 64"},
        {{"--workers", "2", "--balance", "maybe"}, "on or off"},
        {{"--keys", "k"}, "--listen ENDPOINT"},
        {{"--expect", "2"}, "--listen ENDPOINT"},
        {{"--workers", "3", "--listen", "tcp://127.0.0.1:0", "--expect", "2"}, "at least the 3"},
        {{"--processors", "simulated"}, "how many of them"},
        {{"--workers", "2", "--processors", "real"}, "--processors real"},
        {{"--workers", "2", "--processors", "simulated:latency=-1"}, "latency=SECONDS"},
        {{"--workers", "2", "--processors", "simulated:slowdown=0"}, "slowdown=TIMES"},
        {{"--workers", "2", "--processors", "simulated:cost=free"}, "measured|modelled"},
        {{"--workers", "2", "--processors", "simulated", "--listen", "tcp://*:0"}, "one of them"},
    };
    for (const auto& [words, expected] : cases) {
        try {
            (void)options_of(words);
            ADD_FAILURE() << expected;
        } catch (const BadInput& wrong) {
            const std::string message = wrong.what();
            EXPECT_NE(message.find(expected), std::string::npos) << message;
            EXPECT_EQ(message.find("error: found "), 0u) << message;
            EXPECT_NE(message.find(", expected "), std::string::npos) << message;
        }
    }
}

TEST(WorkerOptions, SayHowManyHowAndOfWhichClock) {
    EXPECT_FALSE(options_of({}));  // in this process
    EXPECT_EQ(options_of({"--listen", "tcp://127.0.0.1:0", "--expect", "4"})->count, 0);
    EXPECT_EQ(options_of({"--workers", "2"})->bound, 4);
    EXPECT_EQ(options_of({"--workers", "2", "--bound", "0"})->bound, 0);
    EXPECT_EQ(options_of({"--workers", "2", "--bound", "16"})->bound, 16);
    EXPECT_FALSE(options_of({"--workers", "2", "--balance", "off"})->balance);
    const auto options =
        options_of({"--workers", "3", "--processors", "simulated:latency=1/100,slowdown=50,cost=modelled"});
    ASSERT_TRUE(options && options->simulated);
    EXPECT_EQ(options->simulated->count, 3);
    EXPECT_EQ(options->simulated->latency_s, 0.01);
    EXPECT_EQ(options->simulated->slowdown, 50);
    EXPECT_TRUE(options->simulated->modelled);
}

}  // namespace
}  // namespace app
