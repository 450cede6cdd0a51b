#include "limiter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "audio/loudness.h"

namespace {

constexpr std::size_t kDelay = audio::Limiter::kDelay;

std::vector<float> limited(std::vector<float> sound) {
    audio::Limiter limiter;
    sound.resize(sound.size() + 2 * kDelay, 0.0F);
    for (std::size_t begin = 0; begin + 128 <= sound.size(); begin += 128)
        limiter.limit(std::span(sound).subspan(begin, 128));
    return sound;
}

/// A second of strokes: bursts of noise and tones far over full scale.
std::vector<float> strokes(double peak) {
    std::mt19937 random(3);
    std::vector<float> sound(2 * 48000, 0.0F);
    for (std::size_t n = 0; n < 48000; ++n) {
        const double since = static_cast<double>(n % 9600), fall = std::exp(-since / 2000) * peak;
        const double tone = std::sin(0.5 * 3.14159265 * since + 0.8),
                     noise = static_cast<double>(random()) / 2147483648.0 - 1;
        sound[2 * n] = static_cast<float>(fall * tone);
        sound[2 * n + 1] = static_cast<float>(fall * noise);
    }
    return sound;
}

TEST(Limiter, NoTruePeakGetsOverItsCeilingHoweverLoudWhatComes) {
    for (const double peak : {1.0, 2.0, 8.0}) {
        const std::vector<float> sound = limited(strokes(peak));
        const double found = audio::measure_loudness(sound).true_peak_dbtp.value();
        // libebur128's interpolation is not the recommendation's: 0.3 dB at a quarter of the sampling rate and in noise.
        EXPECT_LE(found, audio::Limiter::kCeilingDbtp + 0.3) << peak;
        EXPECT_GE(found, -6) << "and no more than is needed";
        for (const float x : sound) ASSERT_LT(std::abs(x), 0.9);
    }
    // 34 dB over full scale: the gain's own way is steep there.
    EXPECT_LT(audio::measure_loudness(limited(strokes(50))).true_peak_dbtp.value(), 0);
}

TEST(Limiter, WhatNeedsNoneIsOnlyDelayedToTheBitBeforeAndAfterAPeak) {
    std::vector<float> quiet = strokes(0.5);
    const std::vector<float> same = limited(quiet);
    for (std::size_t i = 0; i < quiet.size(); ++i) ASSERT_EQ(same[i + 2 * kDelay], quiet[i]) << i;
    std::vector<float> loud(2 * 192000, 0.0F);
    for (std::size_t n = 0; n < 192000; ++n)
        loud[2 * n] = static_cast<float>(0.25 * std::sin(0.01 * static_cast<double>(n)));
    loud[2 * 9600] = 4;
    const std::vector<float> sound = limited(loud);
    for (std::size_t n = 0; n < 9600 - kDelay; ++n) ASSERT_EQ(sound[2 * (n + kDelay)], loud[2 * n]);
    for (std::size_t n = 9600 + 2 * 96000; n < 192000; ++n) ASSERT_EQ(sound[2 * (n + kDelay)], loud[2 * n]);
}

TEST(Limiter, ItsGainHasNoSteps) {
    // A slow tone with one peak: the output's slope stays near the tone's own.
    std::vector<float> sound(2 * 48000, 0.0F);
    for (std::size_t n = 0; n < 48000; ++n)
        sound[2 * n] = static_cast<float>(0.5 * std::sin(0.002 * static_cast<double>(n)));
    sound[2 * 24001 + 1] = 8;  // on the other side, which has the same gain
    const std::vector<float> out = limited(sound);
    double largest = 0;
    for (std::size_t n = 1; n < 48000; ++n)
        largest = std::max(largest, std::abs(static_cast<double>(out[2 * n]) - out[2 * n - 2]));
    EXPECT_LT(largest, 0.5 * 0.002 + 0.5 / 50) << "at most the gain's way from 1 over its window";
}

}  // namespace
