// Clocks with simulated delays, whose offsets, drifts and jumps are known. True times are ours.
#include "sensors/source_clock.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <random>

namespace {

using app::SourceClock;

constexpr double kInterval = 1.0 / 120;

struct Mapped {
    double last = -1e300;
    int not_later = 0, none = 0;

    void add(std::optional<double> t) {
        if (!t)
            ++none;
        else if (!(*t > last))
            ++not_later;
        last = std::max(last, t.value_or(last));
    }
};

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

TEST(SourceClock, ConstantDelayIsPartOfTheOffset) {
    SourceClock clock;
    for (int i = 0; i < 500; ++i) {
        const double t = i * kInterval;
        // 1e-12: roundings of sums of about 100.
        EXPECT_NEAR(clock.map(t - 100, t + 0.005).value_or(kNone), t + 0.005, 1e-12);
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
        const double at = clock.map(t + 7, t + delay).value_or(kNone);
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
            const double at = clock.map(t * (1 + ppm * 1e-6) + 3, t + 0.002).value_or(HUGE_VAL);
            worst = std::max(worst, std::abs(at - (t + 0.002)));
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
        mapped.add(clock.map(t + 50 + (t >= 2 ? jump : 0), arrival));
        if (t < 1.9 || t > 2.5) {
            EXPECT_NEAR(mapped.last, t, 0.005) << jump;
        }
    }
    // A jump is believed at the third sample. The two before it are late if it is one back; and have no time of
    // ours if it is one ahead, since they would come before they were taken.
    EXPECT_EQ(mapped.not_later, jump < 0 ? 2 : 0) << jump;
    EXPECT_EQ(mapped.none, jump < 0 ? 0 : 2) << jump;
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
        mapped.add(clock.map(t < 2 ? t : t - 5, t + (t < 2 ? 0 : 6)));  // stood still for 5 of 6 s
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
        mapped.add(clock.map(t, arrival));
        if (i % 50 == 49) (void)clock.map(t - 3 * kInterval, arrival);  // one that another overtook
        if (i % 70 == 69) (void)clock.map(t, arrival);
        EXPECT_NEAR(mapped.last, t, 1e-9);
    }
    EXPECT_EQ(mapped.not_later, 0);
    EXPECT_EQ(clock.estimate().jumps, 0u);
}

TEST(SourceClock, StraySamplesFromAnyTimeCostNothing) {
    // Alone, in pairs, or as every other sample of another sender who uses the stick's name.
    for (const double far : {1e-3 * 300, 60.0, 3600.0, 5e7, -5e7, 1e11})
        for (const int every : {2, 7, 100}) {
            SourceClock clock;
            Mapped mapped;
            for (int i = 0; i < 1200; ++i) {
                const double t = i * kInterval;
                if (i % every == 1) {
                    const std::optional<double> stray = clock.map(t + far, t);
                    EXPECT_EQ(stray.has_value(), far < 0) << far;
                    EXPECT_LT(stray.value_or(-1), t) << far;  // late, if anything
                }
                mapped.add(clock.map(t, t + 0.001));
                EXPECT_NEAR(mapped.last, t + 0.001, 1e-9) << far << ' ' << every;
            }
            EXPECT_EQ(mapped.none + mapped.not_later, 0) << far << ' ' << every;
            EXPECT_EQ(clock.estimate().jumps, 0u) << far << ' ' << every;
        }
}

TEST(SourceClock, AStrayAtTheVeryBeginningCostsTwoSamples) {
    for (const double far : {3600.0, 5e7, -5e7}) {
        SourceClock clock;
        (void)clock.map(far, 0);
        Mapped mapped;
        for (int i = 1; i < 600; ++i) mapped.add(clock.map(i * kInterval, i * kInterval));
        EXPECT_NEAR(mapped.last, 599 * kInterval, 1e-3) << far;
        EXPECT_EQ(clock.estimate().jumps, 1u) << far;
    }
}

/// Whatever a sender does with its times, ours stay near the arrival: what plays them depends on it.
TEST(SourceClock, NoTimesPutASampleFarAfterItsArrival) {
    std::mt19937 random(3);
    const auto uniform = [&random](double to) { return to * static_cast<double>(random() % 10001) / 10000; };
    for (int run = 0; run < 300; ++run) {
        SourceClock clock;
        const double creep = uniform(0.26), spread = std::pow(10, uniform(11)) - 1;
        double source = uniform(100), latest = -HUGE_VAL;
        for (int i = 0; i < 2000; ++i) {
            const double t = i * kInterval;
            source += creep;
            const double given = random() % 10 == 0 ? source + uniform(2 * spread) - spread : source;
            const std::optional<double> at = clock.map(given, t);
            if (!at) continue;
            EXPECT_LE(*at, t + SourceClock::kJumpS + 2e-3) << run;  // a jump adds a microsecond
            latest = std::max(latest, *at);
        }
        EXPECT_GT(latest, 1) << run;  // it does go on
        if (HasFailure()) return;
    }
}

TEST(SourceClock, WallTimeIsToldByItsCount) {
    const double now =
        std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
    // Doubles of 1900's seconds are exact to half a microsecond; a call lies between.
    EXPECT_NEAR(app::ahead_of_wall(now + 5).value_or(kNone), 5, 1);
    EXPECT_NEAR(app::ahead_of_wall(now + 2208988800.0 - 3600).value_or(kNone), -3600, 1);
    EXPECT_FALSE(app::ahead_of_wall(0));
    EXPECT_FALSE(app::ahead_of_wall(3e7));  // a year since the machine was started
}

}  // namespace
