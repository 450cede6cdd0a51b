#include "latency/drawn_error.h"

#include <gtest/gtest.h>

#include "kit/tip_track.h"
#include "sample_realtime.h"

namespace app {
namespace {

/// A stick that moves along x at 1 m/s on a trace from 5 s on, drawn 30 times a second 2 mm too high.
class DrawnErrors : public testing::Test {
protected:
    DrawnErrors() {
        TipTrack track{"left", {}, {}};
        for (int i = 0; i <= 200; ++i) {
            track.t_s.push_back(5 + i * 0.01);
            track.tip.emplace_back(i * 0.01, 0, 0);
        }
        tracks = {track};
        for (std::uint64_t k = 0; k < 30; ++k) {
            FrameTiming frame;
            frame.index = k;
            frame.shown_ns = static_cast<std::int64_t>(k) * 1'000'000'000 / 30;
            run.frames.push_back(frame);
            DrawnTip tip;
            tip.frame = k;
            tip.t_s = 5 + 1e-9 * static_cast<double>(frame.shown_ns);
            tip.drawn = Eigen::Vector3d(tip.t_s - 5, 0.002, 0);
            run.tips.push_back(tip);
        }
    }
    void miss(std::size_t frame) {
        run.frames[frame].fate = FrameFate::late;
        run.tips[frame].shown = false;
    }

    std::vector<TipTrack> tracks;
    RealtimeResult run;
};

constexpr double kRounding = 1e-12;

TEST_F(DrawnErrors, AreThoseOfThePoseShown) {
    const auto errors = drawn_errors(run, tracks, 5);
    ASSERT_EQ(errors.size(), 30U);
    for (const DrawnError& error : errors) EXPECT_NEAR(error.error_m, 0.002, kRounding);
    EXPECT_NEAR(rms_mm(errors, 0, 10), 2, 1e-9);
}

TEST_F(DrawnErrors, OfAMissedFrameAreThoseOfThePictureThatStaysOn) {
    miss(10);
    miss(11);
    const auto errors = drawn_errors(run, tracks, 5);
    ASSERT_EQ(errors.size(), 30U);
    EXPECT_NEAR(errors[10].error_m, std::hypot(1.0 / 30, 0.002), 1e-8);
    EXPECT_NEAR(errors[11].error_m, std::hypot(2.0 / 30, 0.002), 1e-8);
    EXPECT_NEAR(errors[12].error_m, 0.002, kRounding);
    EXPECT_GT(rms_mm(errors, 0.3, 0.4), 20);
    EXPECT_NEAR(rms_mm(errors, 0.5, 1), 2, 1e-9);
}

TEST_F(DrawnErrors, LeaveOutFramesThatWereNotAskedFor) {
    miss(10);
    run.frames[10].asked_for = false;
    EXPECT_EQ(drawn_errors(run, tracks, 5).size(), 29U);
}

TEST_F(DrawnErrors, FollowTheLapsOfALoopedTrace) {
    run.period_s = 0.5;
    for (DrawnTip& tip : run.tips) {
        tip.lap = tip.frame >= 15 ? 1 : 0;
        if (tip.lap == 1) tip.t_s -= 0.5;
    }
    miss(15);  // the picture of the lap before, still on the screen, says nothing of this lap
    const auto errors = drawn_errors(run, tracks, 5);
    ASSERT_EQ(errors.size(), 29U);
    for (const DrawnError& error : errors) EXPECT_NEAR(error.error_m, 0.002, kRounding);
}

TEST_F(DrawnErrors, KnowNoTruthInGapsAndBeforeTheFirstPicture) {
    tracks[0].t_s.erase(tracks[0].t_s.begin() + 40, tracks[0].t_s.begin() + 60);
    tracks[0].tip.erase(tracks[0].tip.begin() + 40, tracks[0].tip.begin() + 60);
    miss(0);
    // Frames 12 (0.4 s) to 17 lie between 0.39 and 0.60 s.
    EXPECT_EQ(drawn_errors(run, tracks, 5).size(), 30U - 1 - 6);
}

}  // namespace
}  // namespace app
