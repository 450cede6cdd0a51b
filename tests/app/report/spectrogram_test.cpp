#include "report/spectrogram.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace {

/// A sine of `hz`, of amplitude `left` and `right`, during [from, to) of a second.
std::vector<float> sine(double hz, double left, double right, double from, double to) {
    std::vector<float> stereo(2 * 48000);
    for (int i = static_cast<int>(from * 48000); i < static_cast<int>(to * 48000); ++i) {
        const double value = std::sin(2 * std::numbers::pi * hz * i / 48000);
        stereo[static_cast<std::size_t>(2 * i)] = static_cast<float>(left * value);
        stereo[static_cast<std::size_t>(2 * i + 1)] = static_cast<float>(right * value);
    }
    return stereo;
}

int loudest_row(const app::Spectrogram& sound, int column) {
    int loudest = 0;
    for (int row = 1; row < sound.rows; ++row)
        if (sound.at(column, row) > sound.at(column, loudest)) loudest = row;
    return loudest;
}

/// A Hann window shows a sine between two frequencies of the transform up to 1.4 dB too low (Harris 1978).
TEST(Spectrogram, ASineHasItsFrequencyAndLevel) {
    for (const double hz : {93.75, 440.0, 3000.0, 15000.0}) {
        const app::Spectrogram sound = app::spectrogram(sine(hz, 0.5, 0.5, 0, 1), 20, 140);
        const int row = loudest_row(sound, 10);
        EXPECT_GE(hz, sound.frequency_hz(row - 1.01)) << "within its row or, below 500 Hz, the next";
        EXPECT_LE(hz, sound.frequency_hz(row + 1.01));
        EXPECT_NEAR(sound.at(10, row), 20 * std::log10(0.5) - 0.7, 0.75) << hz;
    }
}

TEST(Spectrogram, BothSidesAddUpAsPowers) {
    const auto level = [](double left, double right) {
        const app::Spectrogram sound = app::spectrogram(sine(3000, left, right, 0, 1), 20, 140);
        return sound.at(10, loudest_row(sound, 10));
    };
    EXPECT_NEAR(level(0.5, 0) - level(0.5, 0.5), -3.01, 0.01);
    EXPECT_NEAR(level(0, 0.5) - level(0.5, 0), 0, 0.01);
    EXPECT_NEAR(level(0.5, -0.5) - level(0.5, 0.5), 0, 0.01) << "opposite sides do not cancel";
}

/// A window reaches 21 ms to both sides; a column is 50 ms long.
TEST(Spectrogram, ASoundStandsInItsColumns) {
    const app::Spectrogram sound = app::spectrogram(sine(1000, 0.5, 0.5, 0.5, 0.75), 20, 40);
    const int row = loudest_row(sound, 12);
    for (int column = 0; column < 20; ++column) {
        if (column >= 10 && column < 15) {
            EXPECT_GT(sound.at(column, row), -12) << column;
        } else if (column < 9 || column > 15) {
            EXPECT_EQ(sound.at(column, row), -200) << column;
        }
    }
}

TEST(Spectrogram, OfNothingIsSilent) {
    const app::Spectrogram sound = app::spectrogram({}, 3, 4);
    EXPECT_EQ(sound.level_db, std::vector<float>(12, -200));
}

}  // namespace
