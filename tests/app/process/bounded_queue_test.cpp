#include "process/bounded_queue.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

namespace app {
namespace {

TEST(BoundedQueue, PassesEverythingOnInOrder) {
    BoundedQueue<int> queue(3);
    std::vector<int> taken;
    std::thread taker([&] {
        for (int item = 0; queue.pop(item);) taken.push_back(item);
    });
    for (int i = 0; i < 10000; ++i) EXPECT_TRUE(queue.push(i));
    queue.close();
    taker.join();
    ASSERT_EQ(taken.size(), 10000U);
    for (int i = 0; i < 10000; ++i) EXPECT_EQ(taken[static_cast<std::size_t>(i)], i);
}

TEST(BoundedQueue, RefusesWhatThereIsNoRoomFor) {
    BoundedQueue<int> queue(2);
    EXPECT_TRUE(queue.try_push(1));
    EXPECT_TRUE(queue.try_push(2));
    EXPECT_FALSE(queue.try_push(3));
    int item = 0;
    EXPECT_TRUE(queue.pop(item));
    EXPECT_EQ(item, 1);
    EXPECT_TRUE(queue.try_push(4));
    EXPECT_TRUE(queue.pop(item));
    EXPECT_EQ(item, 2);
    EXPECT_TRUE(queue.try_pop(item));
    EXPECT_EQ(item, 4);
    EXPECT_FALSE(queue.try_pop(item)) << "it is empty";
    queue.close();
    EXPECT_FALSE(queue.try_pop(item)) << "and closed";
}

TEST(BoundedQueue, ClosedItGivesWhatItHasAndTakesNoMore) {
    BoundedQueue<int> queue(2);
    EXPECT_TRUE(queue.push(1));
    queue.close();
    EXPECT_FALSE(queue.push(2));
    EXPECT_FALSE(queue.try_push(2));
    int item = 0;
    EXPECT_TRUE(queue.pop(item));
    EXPECT_FALSE(queue.pop(item));
    EXPECT_FALSE(queue.pop(item)) << "and so on";
    queue.close();
    EXPECT_FALSE(queue.pop(item));
}

TEST(BoundedQueue, ClosingWakesAThreadThatWaitsForRoom) {
    BoundedQueue<int> queue(1);
    EXPECT_TRUE(queue.push(1));
    std::thread pusher([&] { EXPECT_FALSE(queue.push(2)); });
    queue.close();
    pusher.join();
    int item = 0;
    EXPECT_TRUE(queue.pop(item));
    EXPECT_FALSE(queue.pop(item));
}

}  // namespace
}  // namespace app
