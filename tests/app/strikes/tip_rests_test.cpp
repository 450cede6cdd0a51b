#include "strikes/tip_rests.h"

#include <gtest/gtest.h>

#include <cmath>

namespace app {
namespace {

constexpr double kStep = 1 / 120.0, kHold = 0.1;

/// Feeds a tip whose height over instrument 0 is height_m(t); instrument 1 is far away.
template <class Height>
std::vector<TipRest> after(TipRests& rests, double from_s, double to_s, Height height_m,
                           std::uint32_t stick = 0) {
    for (double s = from_s; s < to_s; s += kStep) {
        const double clearance[] = {height_m(s), 1.0};
        rests.sample(stick, s, {0, height_m(s), 0}, clearance);
    }
    return rests.take();
}

double lies(double) {
    return -0.001;
}

TEST(TipRests, ATipThatLiesOnASoundingInstrumentEndsItOnceAfterTheHoldTime) {
    TipRests rests({kHold, kHold}, 1);
    rests.struck(0, 0);
    rests.struck(1, 0);
    const auto found = after(rests, 0, 2, lies);
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0].instrument, 0U);
    EXPECT_GE(found[0].s, kHold);
    EXPECT_LT(found[0].s, kHold + 1.5 * kStep);
    rests.struck(0, 3);  // by another stick
    const auto again = after(rests, 2, 4, lies);
    ASSERT_EQ(again.size(), 1U);
    EXPECT_GE(again[0].s, 3);
    EXPECT_LT(again[0].s, 3 + 1.5 * kStep) << "it lay there already";
}

TEST(TipRests, StrokesThatTurnBackAndSticksThatSlideAreNoRest) {
    TipRests rests({kHold, kHold}, 1);
    rests.struck(0, 0);
    // A stroke in the air that goes 20 mm deep and turns back at 20 m/s^2: 0.09 s in the surface.
    EXPECT_TRUE(after(rests, 0, 0.3, [](double s) { return 10 * (s - 0.1) * (s - 0.1) - 0.02; }).empty());
    // One that hovers 4 mm above, and one that goes through slowly.
    EXPECT_TRUE(after(rests, 1, 2, [](double) { return 0.004; }).empty());
    EXPECT_TRUE(after(rests, 2, 3, [](double s) { return -0.1 * (s - 2); }).empty());
    EXPECT_EQ(after(rests, 3, 4, lies).size(), 1U);
}

TEST(TipRests, NothingIsEndedWhereNothingRangOrNoTipMay) {
    TipRests rests({kHold, 0}, 2);
    EXPECT_TRUE(after(rests, 0, 1, lies).empty()) << "not struck";
    rests.struck(0, 1.5);
    rests.restart(0);
    EXPECT_TRUE(after(rests, 1.48, 1.57, lies).empty()) << "a new start has rested for less";
    EXPECT_EQ(after(rests, 1.57, 1.7, lies).size(), 1U);
    TipRests never({0, 0}, 1);
    never.struck(0, 0);
    EXPECT_TRUE(after(never, 0, 1, lies).empty());
}

}  // namespace
}  // namespace app
