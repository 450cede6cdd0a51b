#include "learned/rebounding.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace tracking {
namespace {

constexpr double kHz = 60, kSpeed = 1.5, kRestitution = 0.75, kTopM = 0.3;
constexpr int kDown = 12, kUp = 16;  // samples: 0.3 m at 1.5 m/s, and back at 0.75 of that

/// Falls and rises at constant speeds, and touches the floor at a sample.
PoseSample bouncing(int i) {
    const int phase = i % (kDown + kUp);
    const double y =
        phase < kDown ? kTopM - kSpeed * phase / kHz : kRestitution * kSpeed * (phase - kDown) / kHz;
    return {i / kHz, {0.1 * i / kHz, y, 0}};
}

Rebounding rebounding(const char* path) {
    return Rebounding(make_predictor(path));
}

TEST(Rebounding, IsThePathToTheBitUntilItHasSeenALow) {
    Rebounding rebounds = rebounding("difference");
    const auto path = make_predictor("difference");
    for (int i = 0; i < kDown + 1; ++i) {
        EXPECT_EQ(rebounds.correct(bouncing(i)), path->correct(bouncing(i)));
        const PosePrediction a = rebounds.predict(0.1), b = path->predict(0.1);
        EXPECT_EQ(a.position, b.position);
        EXPECT_EQ(a.velocity, b.velocity);
    }
}

TEST(Rebounding, LearnsTheRestitution) {
    Rebounding rebounds = rebounding("difference");
    int across = 0;
    for (int i = 0; i < 3000; ++i) {
        (void)rebounds.correct(bouncing(i));
        const int phase = i % (kDown + kUp);
        if (i < 2000 || phase < kDown - 4 || phase >= kDown) continue;
        ++across;
        const double depth = kSpeed * (phase + 4 - kDown) / kHz;  // 4 samples ahead, were there no floor
        const PosePrediction predicted = rebounds.predict(4 / kHz);
        // The sum of w d^2 over the last 10 s is 6e-3 m^2 s, so that c takes 1.75 c / 6e-3 = 5 % of the depth.
        EXPECT_NEAR(predicted.position.y(), bouncing(i + 4).position.y(), 0.08 * depth + 1e-9) << i;
        EXPECT_NEAR(predicted.position.x(), bouncing(i + 4).position.x(), 1e-9);
    }
    EXPECT_GT(across, 100);
}

TEST(Rebounding, ItsVelocityIsTheSlopeOfItsPath) {
    Rebounding rebounds = rebounding("difference");
    for (int i = 0; i < 10 * (kDown + kUp) + kDown - 1; ++i) (void)rebounds.correct(bouncing(i));
    constexpr double kStep = 1e-6;
    for (const double lead : {0.02, 0.04, 0.09, 0.12, 0.149, 0.2}) {
        const double slope =
            (rebounds.predict(lead + kStep).position.y() - rebounds.predict(lead - kStep).position.y()) /
            (2 * kStep);
        EXPECT_NEAR(rebounds.predict(lead).velocity.y(), slope, 1e-6) << lead;
        if (lead > 1.0 / 30) {  // before, nothing has ever gone under the floor
            EXPECT_GT(slope, 0) << lead;
        }
    }
}

TEST(Rebounding, SurfaceIsAFadingVelocityThatRebounds) {
    const auto surface = make_predictor("surface"), path = make_predictor("cv:q=1e7,decay=8,r=0.5,gate=5");
    double of_surface = 0, of_path = 0;
    for (int i = 0; i < 12 * (kDown + kUp); ++i) {
        (void)surface->correct(bouncing(i)), (void)path->correct(bouncing(i));
        if (i < 8 * (kDown + kUp)) continue;
        const double truth = bouncing(i + 4).position.y();
        of_surface += std::pow(surface->predict(4 / kHz).position.y() - truth, 2);
        of_path += std::pow(path->predict(4 / kHz).position.y() - truth, 2);
    }
    // A seventh of the predictions 4 samples ahead crosses the low, which the path alone carries on through; at the top both err alike.
    EXPECT_LT(of_surface, 0.75 * of_path);
}

TEST(Rebounding, LeavesAloneWhatPassesTheLows) {
    // Every other low is 0.3 m deeper: of predictions under the mean low about as much passes as rebounds.
    const auto at = [](int i) {
        const double t = i / kHz, deep = std::fmod(t, 1.0) < 0.5 ? 0.15 : 0.3;
        return PoseSample{t, {0, deep * std::cos(4 * std::numbers::pi * t), 0}};
    };
    Rebounding rebounds = rebounding("cv:q=1e7,decay=8");
    const auto path = make_predictor("cv:q=1e7,decay=8");
    double of_rebounds = 0, of_path = 0;
    for (int i = 0; i < 3000; ++i) {
        (void)rebounds.correct(at(i));
        (void)path->correct(at(i));
        of_rebounds += (rebounds.predict(4 / kHz).position - at(i + 4).position).squaredNorm();
        of_path += (path->predict(4 / kHz).position - at(i + 4).position).squaredNorm();
    }
    EXPECT_LT(std::sqrt(of_rebounds), 1.01 * std::sqrt(of_path));
}

TEST(Rebounding, WhatItLearnedOutlastsGaps) {
    Rebounding rebounds = rebounding("difference");
    int i = 0;
    for (; i < 40 * (kDown + kUp); ++i) (void)rebounds.correct(bouncing(i));
    for (int k = 0; k < kDown - 1; ++k) {
        PoseSample sample = bouncing(i + k);
        sample.t_s += 1;
        EXPECT_EQ(rebounds.correct(sample), k == 0 ? SampleStatus::reinitialised : SampleStatus::accepted);
    }
    EXPECT_GT(rebounds.predict(4 / kHz).position.y(), 0);
}

}  // namespace
}  // namespace tracking
