#include "process/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

namespace {

TEST(ParallelFor, EachIndexIsDoneOnce) {
    for (const unsigned threads : {1U, 2U, 7U}) {
        std::vector<int> done(100, 0);
        double share = 0;
        app::parallel_for(
            done.size(), threads, [&](std::size_t i) { ++done[i]; }, [&](double s) { share = s; });
        EXPECT_EQ(done, std::vector<int>(100, 1));
        EXPECT_LE(share, 1);
    }
    app::parallel_for(0, 2, [](std::size_t) { FAIL(); });
}

TEST(ParallelFor, AnExceptionEndsTheWorkAndComesOutOnTheCallingThread) {
    std::atomic<int> started = 0;
    const auto work = [&](std::size_t i) {
        ++started;
        if (i == 3) throw std::runtime_error("three");
        std::this_thread::sleep_for(std::chrono::microseconds(100));  // 5 s in all: an exception takes less
    };
    EXPECT_THROW(app::parallel_for(100000, 2, work), std::runtime_error);
    EXPECT_LT(started, 100000);
}

}  // namespace
