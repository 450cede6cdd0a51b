#include "command_queue.h"

#include <gtest/gtest.h>

#include <memory>
#include <thread>

namespace {

TEST(CommandQueue, HundredThousandValuesPassThroughFourSlotsInOrder) {
    audio::CommandQueue<int> queue(4);
    std::thread writer([&] {
        for (int i = 0; i < 100000; ++i) queue.push(i);
    });
    int wrong = 0;
    for (int i = 0; i < 100000; ++i) wrong += queue.pop() != i;
    writer.join();
    EXPECT_EQ(wrong, 0);
}

TEST(CommandQueue, OwnershipPassesWithTheValue) {
    audio::CommandQueue<std::unique_ptr<int>> queue(2);
    queue.push(std::make_unique<int>(5));
    queue.push(std::make_unique<int>(6));
    EXPECT_EQ(*queue.pop(), 5);
    EXPECT_EQ(*queue.pop(), 6);
}

TEST(CommandQueue, WithoutWaitingNothingIsLostRepeatedOrReordered) {
    audio::CommandQueue<int> queue(4);
    std::thread writer([&] {
        for (int i = 0; i < 100000;) {
            if (queue.try_push(i)) {
                ++i;
            } else {
                std::this_thread::yield();
            }
        }
    });
    int wrong = 0;
    for (int i = 0; i < 100000;) {
        int value = -1;
        if (!queue.try_pop(value)) {
            std::this_thread::yield();
            continue;
        }
        wrong += value != i++;
    }
    writer.join();
    EXPECT_EQ(wrong, 0);
}

TEST(CommandQueue, TryPushSaysThatItIsFullAndTryPopThatItIsEmpty) {
    audio::CommandQueue<int> queue(2);
    int value = 0;
    EXPECT_FALSE(queue.try_pop(value));
    EXPECT_TRUE(queue.try_push(1) && queue.try_push(2));
    EXPECT_FALSE(queue.try_push(3));
    EXPECT_TRUE(queue.try_pop(value) && value == 1);
    EXPECT_TRUE(queue.try_push(4));
}

}  // namespace
