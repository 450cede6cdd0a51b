// Clocks with simulated delays, whose offsets, drifts and jumps are known. True times are ours.
#include "sensors/source_clock.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace {

using app::SourceClock;

constexpr double kInterval = 1.0 / 120;

struct Mapped {
    double last = -1e300;
    int not_later = 0;

    void add(double t) {
        if (!(t > last)) ++not_later;
        last = std::max(last, t);
    }
};

TEST(SourceClock, ConstantDelayIsPartOfTheOffset) {
    SourceClock clock;
    for (int i = 0; i < 500; ++i) {
        const double t = i * kInterval;
        // 1e-12: roundings of sums of about 100.
        EXPECT_NEAR(clock.map(0, t - 100, t + 0.005), t + 0.005, 1e-12);
    }
    EXPECT_NEAR(clock.estimate().offset_s, 100.005, 1e-12);
    EXPECT_NEAR(clock.estimate().delay_p95_s, 0, 1e-12);
    EXPECT_EQ(clock.estimate().jumps, 0u);
}

TEST(SourceClock, JitterOfArrivalIsTakenOutOfTheTimes) {
    SourceClock clock;
    std::mt19937 random(5);
    Mapped mapped;
    double before = 0;
    for (int i = 0; i < 2400; ++i) {
        const double t = i * kInterval, delay = 0.003 + 0.02 * static_cast<double>(random() % 1000) / 1000;
        const double at = clock.map(0, t + 7, t + delay);
        mapped.add(at);
        if (t > 0.3) {
            EXPECT_NEAR(at - before, kInterval, 200.1e-6 * kInterval);  // the slew is at most 200 ppm
        }
        before = at;
    }
    EXPECT_EQ(mapped.not_later, 0);
    // The least of 240 delays spread over 20 ms lies within 1 ms of 3 ms but once in 200 000 windows.
    EXPECT_NEAR(clock.estimate().offset_s, -7 + 0.0035, 0.0005);
    // 19 ms; the quantile of 1024 samples has a deviation of 0.14 ms.
    EXPECT_NEAR(clock.estimate().delay_p95_s, 0.019, 0.001);
}

TEST(SourceClock, FollowsAndTellsDrift) {
    for (const double ppm : {80.0, -80.0}) {
        SourceClock clock;
        double worst = 0;
        for (int i = 0; i < 60 * 120; ++i) {
            const double t = i * kInterval;
            worst =
                std::max(worst, std::abs(clock.map(0, t * (1 + ppm * 1e-6) + 3, t + 0.002) - (t + 0.002)));
        }
        // The window of 2 s sees a clock that is slow by 80 ppm at most 0.16 ms late.
        EXPECT_LT(worst, 0.2e-3) << ppm;
        EXPECT_NEAR(clock.estimate().drift_ppm, ppm, 1) << ppm;
    }
}

/// Samples of a clock that jumps by `jump` at 2 s, with up to 4 ms of delay.
void expect_jump(double jump) {
    SourceClock clock;
    std::mt19937 random(9);
    Mapped mapped;
    for (int i = 0; i < 600; ++i) {
        const double t = i * kInterval, arrival = t + 0.004 * static_cast<double>(random() % 1000) / 1000;
        mapped.add(clock.map(0, t + 50 + (t >= 2 ? jump : 0), arrival));
        if (t < 1.9 || t > 2.5) {
            EXPECT_NEAR(mapped.last, t, 0.005) << jump;
        }
    }
    // A jump back is believed at the third sample; the two before it come late.
    EXPECT_EQ(mapped.not_later, jump < 0 ? 2 : 0) << jump;
    EXPECT_EQ(clock.estimate().jumps, 1u) << jump;
    EXPECT_NEAR(clock.estimate().last_jump_s, jump, 0.03) << jump;  // and the 2 intervals of the late ones
    EXPECT_NEAR(clock.shift_s(), -jump, 0.03) << jump;
}

TEST(SourceClock, JumpsAreFoundAndTimesGoOnIncreasing) {
    for (const double jump : {10.0, 0.3, -0.1, -3600.0}) expect_jump(jump);
}

TEST(SourceClock, ASourceThatStoodStillIsEstimatedAnew) {
    SourceClock clock;
    Mapped mapped;
    for (int i = 0; i < 600; ++i) {
        const double t = i * kInterval;
        mapped.add(clock.map(0, t < 2 ? t : t - 5, t + (t < 2 ? 0 : 6)));  // stood still for 5 of 6 s
    }
    EXPECT_EQ(clock.estimate().jumps, 1u);
    EXPECT_NEAR(clock.estimate().offset_s, 11, 1e-9);
}

TEST(SourceClock, LateRepeatedAndDelayedSamplesAreNoJumps) {
    SourceClock clock;
    Mapped mapped;
    double arrival = 0;
    for (int i = 0; i < 1200; ++i) {
        const double t = i * kInterval;
        const bool held_up = t > 3 && t < 4;  // a second's samples arrive at once
        arrival = std::max(arrival, held_up ? 4.0 : t);
        mapped.add(clock.map(0, t, arrival));
        if (i % 50 == 49) (void)clock.map(0, t - 3 * kInterval, arrival);  // one that another overtook
        if (i % 70 == 69) (void)clock.map(0, t, arrival);
        EXPECT_NEAR(mapped.last, t, 1e-9);
    }
    EXPECT_EQ(mapped.not_later, 0);
    EXPECT_EQ(clock.estimate().jumps, 0u);
}

TEST(SourceClock, SticksShareAClockAndItsJump) {
    SourceClock clock;
    Mapped left, right;
    for (int i = 0; i < 600; ++i) {
        const double t = i * kInterval, source = t < 2 ? t : t - 30;
        left.add(clock.map(0, source, t));
        right.add(clock.map(1, source - 0.002, t));
    }
    EXPECT_EQ(clock.estimate().jumps, 1u);
    EXPECT_LE(left.not_later + right.not_later, 5);  // until the third of one of them
    EXPECT_NEAR(left.last, 599 * kInterval, 1e-3);
}

}  // namespace
