#include "statistics/statistics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <span>
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

using app::PairedDifference;
using app::PairedSums;

PairedSums sums(double of_a, double of_b, std::size_t count) {
    return {{of_a, count}, {of_b, count}};
}

TEST(PairedDifference, APredictorAgainstItselfGainsNothing) {
    const std::vector<PairedSums> groups = {sums(10, 10, 5), sums(40, 40, 8), sums(3, 3, 2)};
    const PairedDifference d = app::paired_difference(groups, 1);
    EXPECT_EQ(d.ratio, 1);
    EXPECT_EQ(d.low, 1);
    EXPECT_EQ(d.high, 1);
    EXPECT_EQ(d.difference_mm, 0);
    EXPECT_TRUE(app::verdict(d).starts_with("no measurable gain")) << app::verdict(d);
}

TEST(PairedDifference, TenPercentInEveryRecordingIsAGainHoweverTheRecordingsDiffer) {
    std::vector<PairedSums> groups;
    for (const double level : {1.0, 100.0, 7.0, 3000.0}) groups.push_back(sums(0.81 * level, level, 10));
    const PairedDifference d = app::paired_difference(groups, 1);
    EXPECT_NEAR(d.ratio, 0.9, 1e-12);  // rounding
    EXPECT_NEAR(d.low, 0.9, 1e-12);
    EXPECT_NEAR(d.high, 0.9, 1e-12);
    EXPECT_TRUE(d.gain());
    EXPECT_EQ(app::verdict(d), "10.0 % better (10.0 to 10.0 %, n = 4)");
}

TEST(PairedDifference, ABaselineWithoutErrorIsWordedNotDividedBy) {
    const std::vector<PairedSums> groups = {sums(10, 0, 5), sums(40, 0, 8)};
    for (const std::size_t count : {1, 2}) {
        const PairedDifference d = app::paired_difference(std::span(groups).first(count), 1);
        EXPECT_EQ(app::verdict(d), "the baseline errs nothing, so there is no ratio");
        EXPECT_GT(d.difference_mm, 0);
    }
}

TEST(PairedDifference, BetterOnHalfAndWorseOnHalfIsNoMeasurableGain) {
    std::vector<PairedSums> groups;
    for (int i = 0; i < 12; ++i) groups.push_back(sums(i % 2 == 0 ? 0.7 : 1.25, 1, 10));
    const PairedDifference d = app::paired_difference(groups, 1);
    EXPECT_LT(d.low, 1);
    EXPECT_GT(d.high, 1);
    EXPECT_LT(d.difference_low_mm, 0);
    EXPECT_GT(d.difference_high_mm, 0);
    EXPECT_FALSE(d.gain());
    EXPECT_FALSE(d.loss());
    EXPECT_TRUE(app::verdict(d).starts_with("no measurable gain"));
}

TEST(PairedDifference, FewerThanItTakesHaveTheirSingleRatiosInsteadOfAnInterval) {
    const std::vector<PairedSums> groups = {sums(1, 4, 10), sums(9, 4, 10), sums(4, 4, 10), sums(1, 1, 10),
                                            sums(1, 1, 10)};
    const PairedDifference four = app::paired_difference(std::span(groups).first(4), 1, 5);
    EXPECT_FALSE(four.has_interval());
    EXPECT_FALSE(four.gain());
    EXPECT_FALSE(four.loss());
    EXPECT_EQ(four.ratios, (std::vector{0.5, 1.5, 1.0, 1.0}));
    EXPECT_EQ(app::verdict(four), "ratio 1.074, no interval from so few (0.500, 1.500, 1.000, 1.000)");
    const PairedDifference five = app::paired_difference(groups, 1, 5);
    EXPECT_TRUE(five.has_interval());
    EXPECT_TRUE(five.ratios.empty());
}

TEST(PairedDifference, OneRecordingHasNoInterval) {
    const std::vector<PairedSums> one = {sums(1, 4, 10)};
    const PairedDifference d = app::paired_difference(one, 1);
    EXPECT_EQ(d.ratio, 0.5);
    EXPECT_FALSE(d.has_interval());
    EXPECT_FALSE(d.gain());
    EXPECT_NE(app::verdict(d).find("no interval"), std::string::npos);
}

TEST(PairedDifference, TheIntervalOf400GroupsIsTheNormalOne) {
    std::vector<PairedSums> groups;
    std::mt19937_64 random(3);
    for (int i = 0; i < 400; ++i)
        groups.push_back(sums(0.5 + static_cast<double>(random() >> 11) / 9007199254740992.0, 1, 1));
    const PairedDifference d = app::paired_difference(groups, 1);
    // ratio^2 is the mean of numbers even in [0.5, 1.5], standard error 0.2887/20; halved by the root. The
    // bootstrap's own quantiles of 10000 draws and the sample's deviation vary by 5 % each: three of these.
    const double half_width = 1.96 * 0.2887 / 20 / 2;
    EXPECT_NEAR((d.high - d.low) / 2, half_width, 0.2 * half_width);
    EXPECT_NEAR(d.ratio, 1, 3.5 * 0.2887 / 20 / 2);
}

TEST(PairedDifference, IntervalsOf20TogetherAreThoseOfAHalfPercentInAllTails) {
    std::vector<PairedSums> groups;
    std::mt19937_64 random(3);
    for (int i = 0; i < 400; ++i)
        groups.push_back(sums(0.5 + static_cast<double>(random() >> 11) / 9007199254740992.0, 1, 1));
    const PairedDifference one = app::paired_difference(groups, 1),
                           of_20 = app::paired_difference(groups, 1, 2, 20);
    EXPECT_EQ(of_20.ratio, one.ratio);
    // Normal quantiles of 1 - 0.025 / 20 and 0.975. Of 10000 draws the outer one's standard error is 3 %.
    EXPECT_NEAR((of_20.high - of_20.low) / (one.high - one.low), 3.0233 / 1.9600, 0.12);
    EXPECT_LT(of_20.difference_low_mm, one.difference_low_mm);
    EXPECT_GT(of_20.difference_high_mm, one.difference_high_mm);
}

TEST(PairedDifference, AVerdictHasOneUnit) {
    std::vector<PairedSums> worse, open;
    for (int i = 0; i < 12; ++i) {
        worse.push_back(sums(1.44, 1, 10));
        open.push_back(sums(i % 2 == 0 ? 0.64 : 1.44, 1, 10));
    }
    EXPECT_EQ(app::verdict(app::paired_difference(worse, 1)), "20.0 % worse (20.0 to 20.0 %, n = 12)");
    const std::string undecided = app::verdict(app::paired_difference(open, 1));
    EXPECT_NE(undecided.find(" % worse to "), std::string::npos) << undecided;
    EXPECT_NE(undecided.find(" % better, n = 12)"), std::string::npos) << undecided;
}

TEST(PairedDifference, TheSameSeedDrawsTheSameInterval) {
    const std::vector<PairedSums> groups = {sums(1, 2, 3), sums(5, 4, 3), sums(2, 2, 3), sums(9, 10, 3)};
    const PairedDifference a = app::paired_difference(groups, 5), b = app::paired_difference(groups, 5);
    EXPECT_EQ(a.low, b.low);
    EXPECT_EQ(a.high, b.high);
}

}  // namespace
