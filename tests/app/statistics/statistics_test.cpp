#include "statistics/statistics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

namespace {

using app::median;
using app::quantile;

std::vector<double> first_naturals(int n) {
    std::vector<double> values(static_cast<std::size_t>(n));
    std::iota(values.rbegin(), values.rend(), 1);  // descending: order does not count
    return values;
}

TEST(Quantile, IsLinearBetweenTheOrderStatisticsAsHyndmanAndFansDefinition7) {
    // Of 1, ..., n it is 1 + (n - 1) p, which definitions 1 to 6, 8 and 9 are not.
    for (const int n : {2, 3, 4, 20, 21, 292})
        for (const double p : {0.0, 0.025, 0.25, 0.5, 0.8, 0.95, 0.99, 1.0})
            EXPECT_NEAR(quantile(first_naturals(n), p), 1 + (n - 1) * p, 1e-12 * n) << n << ", " << p;
    EXPECT_NEAR(quantile({40, 10, 20, 35, 50}, 0.4), 29, 1e-12);  // 20 + 0.6 (35 - 20)
}

TEST(Quantile, OfZeroAndOneIsTheLeastAndTheGreatest) {
    EXPECT_EQ(quantile({3, -7, 11, 0.1}, 0), -7);
    EXPECT_EQ(quantile({3, -7, 11, 0.1}, 1), 11);
    EXPECT_EQ(quantile({5}, 0), 5);
    EXPECT_EQ(quantile({5}, 0.3), 5);
    EXPECT_EQ(quantile({5}, 1), 5);
}

TEST(Quantile, OfTiesIsTheTiedValueItself) {
    EXPECT_EQ(quantile({0.1, 0.1, 0.1, 0.1}, 0.37), 0.1);
    EXPECT_EQ(quantile({1, 2, 2, 2, 3}, 0.3), 2);
    EXPECT_NEAR(quantile({1, 2, 2, 2, 3}, 0.9), 2.6, 1e-12);
}

TEST(Quantile, OfNothingIsNone) {
    EXPECT_TRUE(std::isnan(quantile({}, 0.5)));
    EXPECT_TRUE(std::isnan(median({})));
    EXPECT_TRUE(std::isnan(app::quantile_of_sorted({}, 0)));
}

TEST(Quantile, InfiniteValuesAreValues) {
    const double inf = std::numeric_limits<double>::infinity();
    EXPECT_EQ(quantile({1, inf, inf, inf}, 0.5), inf);
    EXPECT_EQ(quantile({1, 2, inf}, 0.5), 2);
}

TEST(Quantile, OfSortedAndInPlaceAreTheSame) {
    std::vector<double> values = {0.3, 9, -4, 2.5, 2.5, 7, 1e-3};
    std::vector<double> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    for (int i = 0; i <= 100; ++i) {
        const double p = i / 100.0;
        EXPECT_EQ(app::quantile_of_sorted(sorted, p), quantile(values, p)) << p;
        EXPECT_EQ(app::quantile_in_place(values, p), quantile(sorted, p)) << p;
    }
}

TEST(Median, IsTheMiddleOrTheMeanOfTheTwoMiddleValues) {
    EXPECT_EQ(median({3, 1, 2}), 2);
    EXPECT_EQ(median({4, 1, 2, 3}), 2.5);
}

}  // namespace
