#include "realtime/picture_quality.h"

#include <gtest/gtest.h>

namespace {

constexpr double kFrameS = 1.0 / 30;

app::QualityRule rule(double best_s) {
    return app::QualityRule(kFrameS, {best_s, 0.6 * best_s, 0.5 * best_s, 0.2 * best_s, 0.1 * best_s,
                                      0.1 * best_s, 0.1 * best_s});
}

/// Frames from second `from` on, all alike; the reasons for changes.
std::vector<std::string> frames(app::QualityRule& rule, double from_s, int count, bool in_time,
                                double draw_s) {
    std::vector<std::string> reasons;
    for (int i = 0; i < count; ++i)
        if (const auto why = rule.frame(from_s + i * kFrameS, in_time, draw_s)) reasons.push_back(*why);
    return reasons;
}

TEST(PictureQuality, BeginsAtTheBestLevelThatFits) {
    // Half the trial against 0.6 of a frame.
    EXPECT_EQ(rule(1.19 * kFrameS).level(), 0u);
    EXPECT_EQ(rule(1.21 * kFrameS).level(), 1u);
    EXPECT_EQ(rule(2.8 * kFrameS).level(), 3u);  // a fifth of that
    EXPECT_EQ(rule(100 * kFrameS).level(), app::quality_levels().size() - 1);
}

TEST(PictureQuality, ThreeLateFramesOfNinetyLowerItByOneLevelAndSayWhy) {
    app::QualityRule quality = rule(0.01);
    for (int i = 0; i < 300; ++i)  // two of ninety are borne
        EXPECT_FALSE(quality.frame(i * kFrameS, i % 45 != 44, 0.01)) << i;
    EXPECT_EQ(quality.level(), 0u);
    const std::vector<std::string> why = frames(quality, 10, 3, false, 0.04);
    ASSERT_EQ(why.size(), 1u);
    EXPECT_EQ(quality.level(), 1u);
    EXPECT_NE(why[0].find(app::quality_levels()[1].name), std::string::npos) << why[0];
}

TEST(PictureQuality, LateSoundLowersItBeforeMoreOfItIsLate) {
    app::QualityRule quality = rule(0.01);
    EXPECT_FALSE(quality.blocks(0, 150, 3));
    EXPECT_FALSE(quality.blocks(0.2, 150, 4));  // 7 of 300 are below 5 %
    EXPECT_TRUE(quality.blocks(0.4, 150, 20));
    EXPECT_EQ(quality.level(), 1u);
}

TEST(PictureQuality, RisesAfterEightQuietSecondsIfTheBetterLevelWouldFit) {
    app::QualityRule quality = rule(0.01);
    (void)frames(quality, 0, 3, false, 0.04);
    ASSERT_EQ(quality.level(), 1u);
    EXPECT_TRUE(frames(quality, 0.1, 7 * 30, true, 0.006).empty());
    EXPECT_FALSE(frames(quality, 7.1, 2 * 30, true, 0.006).empty());
    EXPECT_EQ(quality.level(), 0u);
}

TEST(PictureQuality, StaysDownWhileDrawingIsSoSlowThatTheBetterLevelWouldNotFit) {
    app::QualityRule quality = rule(0.01);
    (void)frames(quality, 0, 3, false, 0.04);
    // 14 ms at level 1 instead of 6 in the trial: level 0 would take 23 of 33 ms.
    EXPECT_TRUE(frames(quality, 0.1, 60 * 30, true, 0.014).empty());
    EXPECT_FALSE(frames(quality, 61, 20 * 30, true, 0.006).empty());
}

TEST(PictureQuality, ARiseThatHadToBeTakenBackIsTriedLaterAndLater) {
    app::QualityRule quality = rule(0.012);
    double now_s = 0;
    std::vector<double> waits;
    for (int round = 0; round < 4; ++round) {
        while (quality.level() == 0) (void)quality.frame(now_s += kFrameS, false, 0.012);
        const double lowered_s = now_s;
        while (quality.level() == 1) (void)quality.frame(now_s += kFrameS, true, 0.0072);
        waits.push_back(now_s - lowered_s);
    }
    for (std::size_t i = 1; i < waits.size(); ++i) EXPECT_GT(waits[i], 1.8 * waits[i - 1]) << i;
    EXPECT_LT(waits.back(), 66);
}

TEST(PictureQuality, ADelayThatOutgrowsItsLeadLowersPicturesButNotTheirRate) {
    app::QualityRule quality = rule(0.01);
    std::size_t changes = 0;
    for (int i = 0; i < 100; ++i)
        if (quality.outgrown(i * kFrameS)) ++changes;
    EXPECT_EQ(app::quality_levels()[quality.level()].rate_divisor, 1);
    EXPECT_GT(app::quality_levels()[quality.level() + 1].rate_divisor, 1);
    EXPECT_EQ(changes, quality.level());
    app::QualityRule once = rule(0.01);
    EXPECT_TRUE(once.outgrown(1));
    EXPECT_FALSE(once.outgrown(1.2));
    EXPECT_TRUE(once.outgrown(1.26));
}

TEST(PictureQuality, AtHalfTheRateEverySecondFrameIsWanted) {
    const app::QualityRule slow = rule(100);
    const auto every = static_cast<std::uint64_t>(app::quality_levels().back().rate_divisor);
    for (std::uint64_t i = 0; i < 12; ++i) EXPECT_EQ(slow.wants(i), i % every == 0);
    const app::QualityRule fast = rule(0.001);
    EXPECT_TRUE(fast.wants(1));
}

}  // namespace
