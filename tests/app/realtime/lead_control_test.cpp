#include "realtime/lead_control.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace {

constexpr double kAskedS = 1.0 / 30, kReserveS = 0.002, kRateHz = 30;

TEST(LeadControl, NeverFallsBelowTheLeadAskedFor) {
    app::LeadControl lead(kAskedS, kRateHz, kReserveS);
    for (int i = 0; i < 200; ++i) EXPECT_EQ(lead.measured(0.010), kAskedS);
    EXPECT_EQ(lead.delay_s(), 0.010);
}

TEST(LeadControl, CoversADelayThatHasComeToStayWithinASecondWithoutJumps) {
    app::LeadControl lead(kAskedS, kRateHz, kReserveS);
    for (int i = 0; i < 90; ++i) (void)lead.measured(0.020);
    double before = lead.lead_s();
    for (int i = 0; i < 30; ++i) {
        const double now = lead.measured(0.020 + 0.020);
        EXPECT_LE(std::abs(now - before), 0.0015 + 1e-12) << i;
        before = now;
    }
    EXPECT_NEAR(before, 0.040 + kReserveS, 1e-12);
}

TEST(LeadControl, OneLateFrameInAHundredChangesNothing) {
    app::LeadControl lead(kAskedS, 100, kReserveS);  // a window of 200
    for (int i = 0; i < 1000; ++i) EXPECT_EQ(lead.measured(i % 100 == 50 ? 0.09 : 0.02), kAskedS) << i;
}

TEST(LeadControl, ComesBackWhenTheDelayIsGone) {
    app::LeadControl lead(kAskedS, kRateHz, kReserveS);
    for (int i = 0; i < 60; ++i) (void)lead.measured(0.050);
    EXPECT_NEAR(lead.lead_s(), 0.052, 1e-12);
    int frames = 0;
    while (lead.measured(0.020) > kAskedS && frames < 1000) ++frames;
    // 2 s for the window to forget, and 19 ms at 0.5 ms a frame.
    EXPECT_LE(frames, 60 + 38);
    lead = app::LeadControl(kAskedS, kRateHz, kReserveS);
    for (int i = 0; i < 60; ++i) (void)lead.measured(0.050);
    lead.forget();  // as when pictures have become simpler
    frames = 0;
    while (lead.measured(0.020) > kAskedS && frames < 1000) ++frames;
    EXPECT_LE(frames, 38);
}

TEST(LeadControl, PredictsNoFurtherThanPosesCan) {
    app::LeadControl lead(kAskedS, kRateHz, kReserveS);
    for (int i = 0; i < 1000; ++i) (void)lead.measured(10);
    EXPECT_NEAR(lead.lead_s(), 0.15, 1e-12);
}

}  // namespace
