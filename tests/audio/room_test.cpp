#include "room.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "audio/loudness.h"
#include "rendering.h"

namespace {

using namespace rendering;

/// The room's answer to one sample of 1 at the left, both channels.
std::vector<float> answer(const audio::RoomSound& sound, std::size_t frames) {
    audio::Room room(sound);
    std::vector<float> samples(2 * frames, 0.0F);
    samples[0] = 1;
    room.add_answer(samples, samples);
    samples[0] -= 1;
    return samples;
}

double energy(std::span<const float> samples) {
    double sum = 0;
    for (const float x : samples) sum += static_cast<double>(x) * x;
    return sum;
}

TEST(Room, ItsAnswerFallsBy60DbInT60AndFasterAtHighFrequencies) {
    for (const double t60 : {0.3, 0.8, 2.0}) {
        auto samples = answer({t60, 0}, static_cast<std::size_t>(3 * t60 * 48000));
        // Backward integral (Schroeder 1965): its slope from -5 to -25 dB. Two poles leave the low band, below 300 Hz.
        for (int pass = 0; pass < 2; ++pass) {
            double left = 0;
            for (std::size_t i = 0; i < samples.size(); i += 2)
                samples[i] = static_cast<float>(left += 0.04 * (samples[i] - left));
        }
        std::vector<double> rest(samples.size() / 2 + 1, 0);
        for (std::size_t i = samples.size() / 2; i-- > 0;)
            rest[i] = rest[i + 1] + static_cast<double>(samples[2 * i]) * samples[2 * i];
        const auto when = [&](double db) {
            std::size_t i = 0;
            while (10 * std::log10(rest[i] / rest[0]) > db) ++i;
            return static_cast<double>(i) / 48000;
        };
        EXPECT_NEAR(3 * (when(-25) - when(-5)), t60, 0.15 * t60);  // eight lines make a rough slope
    }
}

TEST(Room, ItsEnergyAgainstTheDrySoundsIsTheLevelAsked) {
    for (const double t60 : {0.4, 1.5})
        for (const double level : {-20.0, -6.0}) {
            const double found = 10 * std::log10(energy(answer({t60, level}, 200000)));
            EXPECT_NEAR(found, level, 1) << t60;  // one channel alone
        }
}

TEST(Room, ItComesAfter20MsOnBothSidesEndsAndNoRoomIsNone) {
    const auto samples = answer({0.5, -10}, 96000);
    const std::span all(samples);
    EXPECT_EQ(energy(all.first(2 * 1100)), 0);
    double left = 0, right = 0, product = 0;
    for (std::size_t i = 0; i < samples.size(); i += 2)
        left += samples[i] * samples[i], right += samples[i + 1] * samples[i + 1],
            product += samples[i] * samples[i + 1];
    EXPECT_NEAR(10 * std::log10(left / right), 0, 1.5);
    EXPECT_LT(std::abs(product) / std::sqrt(left * right), 0.3) << "wide";
    const auto tail = static_cast<std::size_t>(2 * audio::Room({0.5, -10}).tail_samples());
    EXPECT_LT(energy(all.subspan(tail)), 1e-8 * energy(all));
    EXPECT_EQ(energy(answer({0, 0}, 1000)), 0);
}

TEST(Mix, AloneEachVoiceAddsUpToTheDryMixChokesIncluded) {
    const std::vector<audio::Voice> voices{voice("cymbal", {}, 0.2, "hat"), voice("cymbal", {}, 0.7, "hat"),
                                           voice("drum", {{"snare", 0.5}})};
    std::vector<audio::Note> notes;
    for (std::uint32_t i = 0; i < 12; ++i) notes.push_back(note(i + 1, 3001 * i, 4, i % 3));
    const auto played = [&](const audio::Mix& mix) {
        audio::Performance performance(kOrchestra, voices, mix);
        for (const audio::Note& each : notes) performance.schedule(each);
        return performance.finish(48000, 0);
    };
    const auto all = played({.gain_db = 3, .room = {}, .alone = {}});
    std::vector<std::vector<float>> stems;
    for (std::uint32_t i = 0; i < 3; ++i)
        stems.push_back(played({.gain_db = 3, .room = {1, 0}, .alone = {i}}));
    for (std::size_t i = 0; i < all.size(); ++i)  // four roundings to float
        ASSERT_NEAR(all[i], stems[0][i] + stems[1][i] + stems[2][i], 2.5e-7) << i;
}

TEST(Mix, LiveSoundsAsOfflineToTheSampleInARoom) {
    const audio::Mix mix{.gain_db = -2, .room = {0.7, -12}, .alone = {}};
    expect_live_as_offline(mix);
}

TEST(Mix, GainOrRoomOutOfRangeIsARuntimeError) {
    for (const audio::Mix& bad : {audio::Mix{.gain_db = 161, .room = {}, .alone = {}},
                                  audio::Mix{.gain_db = 0, .room = {-1, 0}, .alone = {}},
                                  audio::Mix{.gain_db = 0, .room = {1, std::nan("")}, .alone = {}}})
        EXPECT_THROW(audio::Performance(kOrchestra, {}, bad), std::runtime_error);
}

/// 1 kHz at that peak, both channels, as EBU Tech 3341's first two test signals.
std::vector<float> tone(double peak_dbfs, double seconds) {
    std::vector<float> samples;
    for (int i = 0; i < static_cast<int>(48000 * seconds); ++i) {
        const double x = std::pow(10, peak_dbfs / 20) * std::sin(2 * std::numbers::pi * 1000 * i / 48000.0);
        samples.insert(samples.end(), 2, static_cast<float>(x));
    }
    return samples;
}

TEST(Loudness, IsThatOfTheEbusTestSignals) {
    // Tech 3341, cases 1 and 2: stereo sine of 1 kHz at -23 and -33 dBFS for 20 s is -23 and -33 LUFS to 0.1 LU.
    for (const double level : {-23.0, -33.0}) {
        const audio::Loudness found = audio::measure_loudness(tone(level, 20));
        EXPECT_NEAR(found.integrated_lufs.value(), level, 0.1);
        EXPECT_NEAR(found.true_peak_dbtp.value(), level, 0.3);  // Tech 3341: +0.2, -0.4 dB
        EXPECT_NEAR(found.range_lu.value(), 0, 0.1);
    }
    const audio::Loudness silence = audio::measure_loudness(std::vector<float>(96000, 0.0F));
    EXPECT_FALSE(silence.integrated_lufs || silence.range_lu || silence.true_peak_dbtp);
    EXPECT_EQ(audio::gain_towards(silence, -23, -1), 0);
    EXPECT_FALSE(audio::measure_loudness({}).integrated_lufs);
}

TEST(Loudness, TheGainReachesTheTargetOrStopsAtTheHighestPeak) {
    const audio::Loudness quiet{.integrated_lufs = -40, .range_lu = {}, .true_peak_dbtp = -30};
    EXPECT_DOUBLE_EQ(audio::gain_towards(quiet, -23, -1), 17);
    EXPECT_DOUBLE_EQ(audio::gain_towards(quiet, -5, -1), 29);
    const audio::Loudness loud{.integrated_lufs = -10, .range_lu = {}, .true_peak_dbtp = 0};
    EXPECT_DOUBLE_EQ(audio::gain_towards(loud, -23, -1), -13);
}

}  // namespace
