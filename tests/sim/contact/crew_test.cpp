// Threads that share out pieces of work.
#include "contact/crew.h"

#include <gtest/gtest.h>

#include <atomic>
#include <numeric>
#include <vector>

namespace {

TEST(Crew, EachPieceIsDoneOnceByAnyNumberOfThreads) {
    for (const int threads : {1, 2, 5}) {
        sim::Crew crew(threads);
        EXPECT_EQ(crew.size(), threads);
        for (std::size_t count = 0; count < 400; ++count) {
            std::vector<int> done(count, 0);
            std::atomic<int> worst = 0;
            crew.each(count, 3, [&](int thread, std::size_t first, std::size_t last) {
                if (thread < 0 || thread >= threads) worst = 1;
                for (std::size_t i = first; i < last; ++i) ++done[i];
            });
            ASSERT_EQ(std::accumulate(done.begin(), done.end(), 0), int(count));
            ASSERT_TRUE(std::ranges::all_of(done, [](int n) { return n == 1; }));
            ASSERT_EQ(worst, 0);
        }
    }
}

}  // namespace
