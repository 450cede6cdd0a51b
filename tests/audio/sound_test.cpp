#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "rendering.h"

namespace {

using namespace rendering;

std::vector<double> struck(const audio::Voice& sound, double speed, double place = 0.3, int zone = 0) {
    return left(render({sound}, {note(1, 0, speed, 0, place, zone)}, 48000));
}

/// Fourier sum of `samples` from `begin` under a Hann window, at `frequency_hz`, phase counted from sample 0.
std::complex<double> fourier(const std::vector<double>& samples, std::size_t begin, std::size_t length,
                             double frequency_hz) {
    const double step = 2 * std::numbers::pi * frequency_hz / audio::kSampleRate;
    std::complex<double> sum = 0;
    for (std::size_t i = 0; i < length && begin + i < samples.size(); ++i) {
        const double window =
            0.5 - 0.5 * std::cos(2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(length));
        sum += samples[begin + i] * window * std::polar(1.0, -step * static_cast<double>(begin + i));
    }
    return sum;
}

/// Cents by which the partial near `expected_hz` differs from it: the phase's advance between two windows.
double cents_off(const std::vector<double>& samples, std::size_t begin, std::size_t length,
                 double expected_hz) {
    const std::size_t hop = length / 4;
    const std::complex<double> turn =
        fourier(samples, begin + hop, length, expected_hz) / fourier(samples, begin, length, expected_hz);
    const double difference =
        std::arg(turn) * audio::kSampleRate / (2 * std::numbers::pi * static_cast<double>(hop));
    return 1200 * std::log2(1 + difference / expected_hz);
}

double loudness_db(const std::vector<double>& samples) {
    double sum = 0;
    for (const double x : samples) sum += x * x;
    return 10 * std::log10(sum);
}

/// Centre of the first 85 ms' power spectrum, in Hz.
double centroid_hz(const std::vector<double>& samples) {
    double weighted = 0, total = 0;
    for (double frequency = 50; frequency < 20000; frequency += 100) {
        const double power = std::norm(fourier(samples, 0, 4096, frequency));
        weighted += frequency * power;
        total += power;
    }
    return weighted / total;
}

class Sound : public testing::TestWithParam<std::string> {};

TEST_P(Sound, LoudnessRisesWithSpeedByAbout40DbFrom0Point2To8MetresASecond) {
    double before = -1000;
    std::vector<double> levels;
    for (const double speed : {0.2, 0.3, 0.5, 0.8, 1.2, 2.0, 3.0, 5.0, 8.0}) {
        levels.push_back(loudness_db(struck(voice(GetParam()), speed)));
        EXPECT_GT(levels.back(), before + 1) << speed << " m/s";
        before = levels.back();
    }
    // Amplitude ~ v^1.33: 42.6 dB, less what the soft stroke gains, whose low modes last longer; the strokes vary
    // by 0.4 dB.
    EXPECT_NEAR(levels.back() - levels.front(), 40, 3);
}

TEST_P(Sound, BrightnessRisesWithSpeed) {
    double before = 0;
    for (const double speed : {0.3, 1.0, 3.0, 8.0}) {
        const double centroid = centroid_hz(struck(voice(GetParam()), speed));
        EXPECT_GT(centroid, before * 1.01) << speed << " m/s";
        before = centroid;
    }
}

TEST_P(Sound, FullStrokePeaksBetweenMinus16AndMinus7DbFullScale) {
    for (const int zone : {0, 1}) {
        for (const double place : {0.0, 0.3, 1.0}) {
            double peak = 0;
            for (const double x : left(render({voice(GetParam(), {}, 0)}, {note(1, 0, 8, 0, place, zone)}))) {
                peak = std::max(peak, std::abs(x));
            }
            EXPECT_GT(20 * std::log10(peak), -16) << "place " << place << ", zone " << zone;
            EXPECT_LT(20 * std::log10(peak), -7) << "place " << place << ", zone " << zone;
        }
    }
}

TEST_P(Sound, EndsInExactSilenceWithoutAStep) {
    const std::vector<audio::Voice> voices{voice(GetParam(), {{"decay_s", 0.5}})};
    // A note that ends, exact silence, then a marker that keeps the file long.
    const auto sound = left(render(voices, {note(1, 0, 8), note(2, 240000, 8)}));
    std::size_t last = 0;
    for (std::size_t i = 0; i < 240000; ++i) {
        ASSERT_TRUE(std::isfinite(sound[i]));
        ASSERT_TRUE(sound[i] == 0 || std::abs(sound[i]) > 1.2e-38) << "denormal at " << i;
        if (sound[i] != 0) last = i;
    }
    EXPECT_LT(last, 200000U);
    // The last 50 ms fade from below -95 dBFS.
    for (std::size_t i = last - 2400; i <= last; ++i) ASSERT_LT(std::abs(sound[i]), 2e-5);
}

TEST_P(Sound, HasNoOffset) {
    const auto sound = struck(voice(GetParam()), 5);
    double sum = 0, peak = 0;
    for (const double x : sound) sum += x, peak = std::max(peak, std::abs(x));
    EXPECT_LT(std::abs(sum) / static_cast<double>(sound.size()),
              2e-3 * peak);  // the first half-wave's area over a second
}

TEST_P(Sound, ZonesAndPlacesDiffer) {
    const auto plain = struck(voice(GetParam()), 3, 0.2);
    EXPECT_NE(plain, struck(voice(GetParam()), 3, 0.9));
    EXPECT_EQ(plain == struck(voice(GetParam()), 3, 0.2, 1),
              GetParam() == "string");  // a string has one zone
}

INSTANTIATE_TEST_SUITE_P(Instruments, Sound, testing::ValuesIn(kInstruments),
                         [](const auto& each) { return each.param; });

TEST(Pitch, BellsAndStringsAreWithin2CentsFrom55To4000Hz) {
    for (const double frequency : {55.0, 110.0, 261.6256, 997.0, 2093.0, 3951.07}) {
        for (const double set : {0.0, 1.0, 2.0, 3.0}) {
            const auto bell =
                struck(voice("bell", {{"frequency_hz", frequency}, {"decay_s", 6}, {"partials", set}}), 2);
            EXPECT_NEAR(cents_off(bell, 4800, 14400, frequency), 0, 2)
                << "bell " << set << ", " << frequency << " Hz";
        }
        const auto string = struck(voice("string", {{"frequency_hz", frequency}, {"decay_s", 4}}), 2);
        EXPECT_NEAR(cents_off(string, 4800, 14400, frequency), 0, 2) << "string, " << frequency << " Hz";
    }
}

TEST(Pitch, StringPartialsFollowTheStiffStringLawWithin2Cents) {
    const double f = 220, b = 0.0005;
    const auto sound =
        struck(voice("string", {{"frequency_hz", f}, {"inharmonicity", b}, {"damping", 0.2}}), 5);
    for (const int n : {2, 3, 5}) {
        const double expected = n * f * std::sqrt((1 + b * n * n) / (1 + b));
        EXPECT_NEAR(cents_off(sound, 4800, 9600, expected), 0, 2) << "partial " << n;
    }
}

TEST(Pitch, DrumsSettleWithin10CentsAndStartHigherWhenStruckHarder) {
    for (const double frequency : {55.0, 120.0, 300.0}) {
        const auto drum = voice("drum", {{"frequency_hz", frequency}, {"decay_s", 2}, {"bend_cents", 100}});
        const auto hard = struck(drum, 8, 0.0), soft = struck(drum, 0.5, 0.0);
        EXPECT_NEAR(cents_off(hard, 28800, 9600, frequency), 0, 10) << frequency;
        EXPECT_NEAR(cents_off(soft, 28800, 9600, frequency), 0, 10) << frequency;
    }
    const auto drum = voice("drum", {{"frequency_hz", 300}, {"decay_s", 2}, {"bend_cents", 100}});
    EXPECT_GT(cents_off(struck(drum, 8, 0), 480, 2400, 300),
              cents_off(struck(drum, 1, 0), 480, 2400, 300) + 20);
}

TEST(Pitch, KettledrumSoundsItsPrincipalToneFifthAndOctave) {
    const auto sound = struck(
        voice("drum", {{"frequency_hz", 110}, {"kettle", 1}, {"decay_s", 4}, {"bend_cents", 0}}), 3, 0.8);
    for (const double ratio : {1.0, 1.5, 1.98, 2.44})
        EXPECT_NEAR(cents_off(sound, 4800, 19200, 110 * ratio), 0, 10) << ratio;
}

TEST(StruckPlace, TheCentreOfADrumHasNoNodalDiameters) {
    const auto drum =
        voice("drum", {{"bend_cents", 0}, {"decay_s", 3}, {"frequency_hz", 200}, {"attack", 0}});
    const double f11 = 200 * 3.831706 / 2.404826;  // mode (1,1)
    const auto share = [&](double place) {
        const auto sound = struck(drum, 3, place);
        return std::abs(fourier(sound, 0, 19200, f11)) / std::abs(fourier(sound, 0, 19200, 200));
    };
    EXPECT_LT(share(0), 0.15 * share(0.7));
}

TEST(StruckPlace, AStringStruckAtHalfItsLengthLacksEvenPartials) {
    const auto sound =
        struck(voice("string", {{"strike_point", 0.5}, {"attack", 0}, {"inharmonicity", 0}}), 3, 0);
    EXPECT_LT(std::abs(fourier(sound, 0, 19200, 440)), 0.01 * std::abs(fourier(sound, 0, 19200, 220)));
}

TEST(Decay, TheFirstPartialFallsBy60DbInDecaySeconds) {
    for (const double decay : {0.5, 2.0}) {
        const auto sound = struck(voice("string", {{"decay_s", decay}, {"attack", 0}}), 5);
        const double early = std::abs(fourier(sound, 4800, 4800, 220)),
                     late = std::abs(fourier(sound, 14400, 4800, 220));
        EXPECT_NEAR(20 * std::log10(early / late), 60 * 0.2 / decay, 0.1);  // 0.2 s apart
    }
}

}  // namespace
