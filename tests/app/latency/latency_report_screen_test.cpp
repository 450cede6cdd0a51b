#include <gtest/gtest.h>

#include "kit/kit.h"
#include "latency/latency_report.h"
#include "sample_realtime.h"

namespace app {
namespace {

/// Roots are found to 1e-10 of the time between frames; the surface's place to rounding.
constexpr double kRootMs = 1e-5;

class SoundAndPicture : public testing::Test {
protected:
    std::vector<SoundPicture> match(const std::vector<double>& onsets_s, std::uint32_t stick = 0,
                                    std::uint64_t lap = 0) {
        play.strikes.clear();
        run.notes.cut(0);
        sample::sound(play, run, onsets_s, stick, lap);
        return sound_and_picture(play, run, kit, sample::kTipRadius);
    }

    Kit kit = sample::one_drum();
    double touch_m = sample::touch_height(kit);
    PlayResult play;
    RealtimeResult run;
};

TEST_F(SoundAndPicture, AStickThatFallsEvenlyTouchesBetweenItsFrames) {
    sample::draw(run, sample::falling(1.013, touch_m, 2), 0.9, 1.1);
    const auto matched = match({1.020});
    ASSERT_EQ(matched.size(), 1U);
    EXPECT_NEAR(matched[0].touch_s, 1.013, 1e-3 * kRootMs);
    EXPECT_NEAR(matched[0].sound_minus_picture_ms(), 7, kRootMs);
}

TEST_F(SoundAndPicture, AnEarlySoundIsNegative) {
    sample::draw(run, sample::falling(1.013, touch_m, 2), 0.9, 1.1);
    EXPECT_NEAR(match({1.0})[0].sound_minus_picture_ms(), -13, kRootMs);
}

TEST_F(SoundAndPicture, AParabolaOfTwoFramesIsExact) {
    // A cubic through places and velocities holds every parabola: -40 m/s^2 from rest, 1 m/s at the surface.
    const double fall_s = 0.025;
    const auto since = [](double t) { return t - 0.985; };
    sample::draw(run,
                 {[&](double t) { return touch_m + 20 * fall_s * fall_s - 20 * since(t) * since(t); },
                  [&](double t) { return -40 * since(t); }},
                 0.99, 1.03);
    ASSERT_EQ(run.tips.size(), 2U);
    EXPECT_NEAR(match({1.012})[0].sound_minus_picture_ms(), 2, kRootMs);
}

TEST_F(SoundAndPicture, FollowsTheClocksOfTraceAndLap) {
    play.t0_s = 0.25;
    run.period_s = 2;
    sample::draw(run, sample::falling(1.013, touch_m, 2), 0.9, 1.1, 30, 0, 3);
    const auto matched = match({1.020}, 0, 3);
    ASSERT_EQ(matched.size(), 1U);
    EXPECT_NEAR(matched[0].onset_s, 1.020, 1e-12);
    EXPECT_NEAR(matched[0].sound_minus_picture_ms(), 7, kRootMs);
    EXPECT_EQ(run.notes[0].played.onset_sample, 48000 * 677 / 100);  // 0.77 s into the fourth lap
}

/// Frames every 1/30 s from 0.9: the first one behind the surface after 1.013 is that at 1.0333.
TEST_F(SoundAndPicture, TheFirstFrameBehindTheSurfaceIsUpToAFrameLater) {
    sample::draw(run, sample::falling(1.013, touch_m, 2), 0.9, 1.1);
    const SoundPicture one = match({1.020})[0];
    ASSERT_TRUE(one.frame_s);
    EXPECT_NEAR(*one.frame_s, 0.9 + 4.0 / 30, 1e-12);
    EXPECT_NEAR(*one.sound_minus_frame_ms(), 1e3 * (1.020 - 0.9 - 4.0 / 30), 1e-9);
}

TEST_F(SoundAndPicture, AHeldStickShowsItsContactThoughItsPoseIsOutAgain) {
    // In and out again between two frames.
    const auto height = [this](double t) { return touch_m + 40 * (t - 1.01) * (t - 1.02); };
    sample::draw(run, {height, [](double t) { return 40 * (2 * t - 2.03); }}, 0.9, 1.1);
    run.tips[4].held = true;  // at 1.0333
    const auto matched = match({1.010});
    ASSERT_EQ(matched.size(), 1U);
    EXPECT_NEAR(matched[0].sound_minus_picture_ms(), 0, kRootMs);
    EXPECT_NEAR(*matched[0].frame_s, 0.9 + 4.0 / 30, 1e-12);
    run.tips[4].held = false;
    EXPECT_FALSE(match({1.010})[0].frame_s);
}

TEST_F(SoundAndPicture, TakesTheNearestOfSeveralStrokes) {
    // Down through the surface at 1.0, 1.1, 1.2: 15 cm of amplitude at 10 Hz.
    const double w = 2 * std::acos(-1.0) * 10;
    sample::draw(run,
                 {[&](double t) { return touch_m - 0.15 * std::sin(w * (t - 1)); },
                  [&](double t) { return -0.15 * w * std::cos(w * (t - 1)); }},
                 0.8, 1.4, 480);
    const auto matched = match({1.003, 1.097, 1.149});
    ASSERT_EQ(matched.size(), 3U);
    // The cubic between frames 2 ms apart differs from the sine by 1e-6 of its amplitude.
    EXPECT_NEAR(matched[0].sound_minus_picture_ms(), 3, 1e-3);
    EXPECT_NEAR(matched[1].sound_minus_picture_ms(), -3, 1e-3);
    EXPECT_NEAR(matched[2].sound_minus_picture_ms(), 49, 1e-3);
}

TEST_F(SoundAndPicture, AStrokeThatStopsShortOrIsFarInTimeMatchesNothing) {
    sample::draw(run, sample::falling(1.2, touch_m + 0.01, 0.05), 0.9, 1.3);
    EXPECT_TRUE(match({1.2}).empty());
    run.tips.cut(0);
    sample::draw(run, sample::falling(1.0, touch_m, 2), 0.5, 1.5);
    EXPECT_TRUE(match({1.151}).empty());
    EXPECT_EQ(match({1.149}).size(), 1U);
}

TEST_F(SoundAndPicture, OtherSticksAndLapsDoNotCount) {
    sample::draw(run, sample::falling(1.013, touch_m, 2), 0.9, 1.1, 30, 1, 2);
    EXPECT_TRUE(match({1.020}, 0, 2).empty());
    EXPECT_TRUE(match({1.020}, 1, 1).empty());
    EXPECT_EQ(match({1.020}, 1, 2).size(), 1U);
}

TEST_F(SoundAndPicture, LeavesOutFramesThatWereNotShown) {
    sample::draw(run, sample::falling(1.013, touch_m, 2), 0.9, 1.1);
    run.tips[3].tip.y() += 0.5;  // of a late frame
    run.tips[3].shown = false;
    EXPECT_NEAR(match({1.020})[0].sound_minus_picture_ms(), 7, kRootMs);
}

TEST_F(SoundAndPicture, NoCurveJoinsFramesThatLieFarApart) {
    sample::draw(run, sample::falling(1.013, touch_m, 2), 0.8, 1.3, 1 / 0.26);
    EXPECT_TRUE(match({1.020}).empty());
}

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

constexpr double kRoundingM = 1e-12;

TEST_F(DrawnErrors, AreThoseOfThePoseShown) {
    const auto errors = drawn_errors(run, tracks, 5);
    ASSERT_EQ(errors.size(), 30U);
    for (const DrawnError& error : errors) EXPECT_NEAR(error.error_m, 0.002, kRoundingM);
    EXPECT_NEAR(rms_mm(errors, 0, 10), 2, 1e-9);
}

TEST_F(DrawnErrors, OfAMissedFrameAreThoseOfThePictureThatStaysOn) {
    miss(10);
    miss(11);
    const auto errors = drawn_errors(run, tracks, 5);
    ASSERT_EQ(errors.size(), 30U);
    EXPECT_NEAR(errors[10].error_m, std::hypot(1.0 / 30, 0.002), 1e-8);
    EXPECT_NEAR(errors[11].error_m, std::hypot(2.0 / 30, 0.002), 1e-8);
    EXPECT_NEAR(errors[12].error_m, 0.002, kRoundingM);
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
    for (const DrawnError& error : errors) EXPECT_NEAR(error.error_m, 0.002, kRoundingM);
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
