#include "shared/neighbour_streams.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

namespace sim {
namespace {

constexpr std::uint32_t kOther = 7;
constexpr std::uint32_t kAnyEpoch = ~std::uint32_t{0};

NeighbourMessage message(std::uint32_t number, std::size_t crossed = 0) {
    NeighbourMessage m;
    m.number = number, m.crossed.resize(crossed);
    return m;
}

NeighbourStreams streams(std::size_t bodies = 10) {
    NeighbourStreams s(bodies, 4);
    s.add(kOther);
    return s;
}

// Some come twice, and any before any.
TEST(NeighbourStreams, MessagesAreHeardOnceAndInOrder) {
    std::mt19937 random(3);
    for (int trial = 0; trial < 50; ++trial) {
        NeighbourStreams s = streams();
        std::vector<std::uint32_t> numbers(60), heard;
        std::iota(numbers.begin(), numbers.end(), 1);
        for (int i = 0; i < 20; ++i) numbers.push_back(1 + random() % 60);
        std::ranges::shuffle(numbers, random);
        for (const std::uint32_t number : numbers) {
            s.put({kOther, 0, number}, message(number));
            while (const auto next = s.take(kOther, kAnyEpoch))
                heard.push_back(std::get<NeighbourMessage>(next->message).number);
        }
        ASSERT_EQ(heard.size(), 60u);
        for (std::uint32_t i = 0; i < 60; ++i) EXPECT_EQ(heard[i], i + 1);
        EXPECT_EQ(s.untold(kOther), 60u);
        EXPECT_EQ(s.tell_heard(kOther), 60u);
        EXPECT_EQ(s.untold(kOther), 0u);
    }
}

TEST(NeighbourStreams, WhatKnowsOfLaterOwnersWaitsAndWhatComesAfterItToo) {
    NeighbourStreams s = streams();
    s.put({kOther, 5, 1}, message(1));
    s.put({kOther, 4, 2}, message(2));
    EXPECT_FALSE(s.take(kOther, 4));
    EXPECT_TRUE(s.take(kOther, 5));
    EXPECT_TRUE(s.take(kOther, 4));
    EXPECT_FALSE(s.take(kOther, 5));
}

TEST(NeighbourStreams, WhatIsNotHeardIsToldAgainButNotTwiceForOneLoss) {
    NeighbourStreams s = streams();
    for (std::uint8_t i = 1; i <= 10; ++i) s.sent(kOther, {i});
    s.heard_by(kOther, 6);
    const std::vector<std::vector<std::uint8_t>> expected = {{7}, {8}, {9}, {10}};
    EXPECT_EQ(s.again(kOther), expected);
    EXPECT_TRUE(s.again(kOther).empty());  // that went by way of the application, which loses nothing
    s.sent(kOther, {11});
    EXPECT_EQ(s.again(kOther), (std::vector<std::vector<std::uint8_t>>{{11}}));
    EXPECT_FALSE(s.all_heard_by(kOther));
    s.heard_by(kOther, 11);
    EXPECT_TRUE(s.all_heard_by(kOther));
    s.heard_by(kOther, 3);  // an older message came later
    EXPECT_TRUE(s.all_heard_by(kOther));
    s.sent(kOther, {12});
    s.heard_by(kOther, 13);  // it lies
    EXPECT_EQ(s.again(kOther).size(), 1u);
}

// What a member may have another one keep: of what it says, and of what it does not say that it has heard.
TEST(NeighbourStreams, NobodyMakesAnotherKeepMoreThanStepsNeed) {
    NeighbourStreams s = streams();
    for (int i = 0; i < 5000; ++i) s.sent(kOther, {1});
    EXPECT_LT(s.again(kOther).size(), 200u);
    EXPECT_THROW(s.put({kOther, 0, 1}, message(1000)), DecodeError);
    EXPECT_THROW(
        {
            for (std::uint32_t number = 2; number < 60; ++number)
                s.put({kOther, 0, 1}, message(number, 10000));
        },
        DecodeError);
    s.put({kOther, 0, 1}, message(1));
    EXPECT_THROW(
        {
            for (int i = 0; i < 10000; ++i) s.put({kOther, 0, 1}, message(1));
        },
        DecodeError);
}

}  // namespace
}  // namespace sim
