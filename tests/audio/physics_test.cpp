#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <numbers>

#include "rendering.h"
#include "spectra.h"

// What the built-in sounds owe to the literature that the orchestra cites, measured in their samples.

namespace {

using namespace rendering;

/// Strokes that are all alike, unless a test asks for the small differences.
audio::Voice even_voice(const std::string& instrument, Parameters parameters = {}, double pan = 0) {
    parameters.emplace_back("variation", 0);
    return voice(instrument, std::move(parameters), pan);
}

std::vector<double> strike(const audio::Voice& sound, double speed, double place = 0.3,
                           std::int64_t samples = 96000) {
    return left(render({sound}, {note(1, 0, speed, 0, place)}, samples));
}

double peak_of(const std::vector<double>& samples) {
    double peak = 0;
    for (const double x : samples) peak = std::max(peak, std::abs(x));
    return peak;
}

/// Amplitude of the partial at `frequency_hz` under a Hann window.
double amplitude(const std::vector<double>& samples, std::size_t begin, std::size_t length,
                 double frequency_hz) {
    std::complex<double> sum = 0;
    for (std::size_t i = 0; i < length && begin + i < samples.size(); ++i) {
        const double turn = 2 * std::numbers::pi * static_cast<double>(i);
        const double window = 0.5 - 0.5 * std::cos(turn / static_cast<double>(length));
        sum += samples[begin + i] * window * std::polar(1.0, -turn * frequency_hz / audio::kSampleRate);
    }
    return std::abs(sum) / static_cast<double>(length) * 4;
}

/// T60 of that partial, from its levels in two windows 0.1 s apart, the first of them at 50 ms.
double t60_s(const std::vector<double>& samples, double frequency_hz) {
    const double early = amplitude(samples, 2400, 9600, frequency_hz),
                 late = amplitude(samples, 7200, 9600, frequency_hz);
    return 60 * 0.1 / (20 * std::log10(early / late));
}

class Physics : public testing::TestWithParam<std::string> {};

TEST_P(Physics, AStrokesFirstSampleIsBelow5PercentOfItsPeakFrom0Point25To8MetresASecond) {
    for (const double speed : {0.25, 1.0, 3.0, 8.0}) {
        for (const double hardness : {0.1, 0.5, 0.9}) {
            for (const double place : {0.0, 0.3, 1.0}) {
                const auto sound =
                    strike(even_voice(GetParam(), {{"hardness", hardness}}), speed, place, 9600);
                EXPECT_NE(sound.front(), 0) << "it begins at its onset";
                EXPECT_LT(std::abs(sound.front()), 0.05 * peak_of(sound))
                    << speed << " m/s, hardness " << hardness << ", place " << place;
            }
        }
    }
}

TEST_P(Physics, EqualStrokesDifferALittleEachByItsOwnOnsetAlone) {
    const audio::Voice varied = voice(GetParam(), {{"variation", 1}}, 0);
    const std::int64_t apart = 64 * 12000;
    const auto sound = left(render({varied}, {note(1, 64, 3), note(2, 64 + apart, 3)}, 64 + 2 * apart, 0));
    const auto alone = left(render({varied}, {note(7, 64 + apart, 3)}, 64 + 2 * apart, 0));
    double difference = 0, power = 0;
    for (std::size_t i = 64; i < 9600; ++i) {
        ASSERT_EQ(sound[i + apart], alone[i + apart]) << "whatever sounded before";
        difference += std::pow(sound[i + apart] - sound[i], 2);
        power += sound[i] * sound[i];
    }
    EXPECT_GT(difference, 1e-4 * power);  // 40 dB below: heard side by side
    EXPECT_LT(difference, 0.7 * power);   // and yet the same stroke: the noises alone are all new
}

INSTANTIATE_TEST_SUITE_P(Instruments, Physics, testing::ValuesIn(kInstruments),
                         [](const auto& each) { return each.param; });

audio::Voice tom(double frequency_hz) {
    return even_voice("drum", {{"frequency_hz", frequency_hz},
                               {"decay_s", 1.6},
                               {"damping", 0.9},
                               {"hardness", 0.42},
                               {"bend_cents", 90}});
}

TEST(Contact, ATomsCentroidRisesWithEveryDoublingOfTheSpeed) {
    for (const double frequency : {88.0, 130.0, 165.0}) {
        double before = 0;
        for (const double speed : {0.5, 1.0, 2.0, 4.0, 8.0}) {
            const double centroid = centroid_hz(strike(tom(frequency), speed, 0.3, 4800));
            EXPECT_GT(centroid, before) << frequency << " Hz, " << speed << " m/s";
            before = centroid;
        }
    }
}

TEST(Contact, ATomsCentroidAtLeastDoublesFrom0Point5To8MetresASecondWhereverItIsStruck) {
    for (const double frequency : {74.0, 110.0, 165.0}) {
        double least = 100;
        for (const double place : {0.0, 0.2, 0.4, 0.6, 0.7, 0.8, 0.9})
            least = std::min(least, centroid_hz(strike(tom(frequency), 8, place, 4800)) /
                                        centroid_hz(strike(tom(frequency), 0.5, place, 4800)));
        std::printf("tom of %.0f Hz: the centroid grows at least %.2f times\n", frequency, least);
        EXPECT_GE(least, 2) << frequency;
    }
}

TEST(Contact, ASofterTipAHeavierAndARounderOneAreAsHertzsLawHasThem) {
    // Through the first zero of the contact's spectrum, 1.5 / T, in the sound of the contact alone: where the struck thing's one low
    // partial is far below.
    const auto contact_s = [](double radius, double mass, double young, double speed) {
        const double modulus = 1 / (1 / 1e7 + 1 / young);
        return 2.943 * std::pow(15 * mass / (16 * modulus * std::sqrt(radius)), 0.4) * std::pow(speed, -0.2);
    };
    const auto zero_depth = [&](double radius, double mass, double young, double speed) {
        // hardness 0.25: 10 MPa. One mode of 30 Hz, 10 s: what it answers to is the force's integral.
        const auto sound = strike(even_voice("bell", {{"frequency_hz", 100},
                                                      {"partials", 2},
                                                      {"decay_s", 10},
                                                      {"hardness", 0.25},
                                                      {"attack", 0},
                                                      {"damping", 0},
                                                      {"width", 0},
                                                      {"tip_radius_m", radius},
                                                      {"tip_mass_kg", mass},
                                                      {"tip_young_pa", young}}),
                                  speed, 0, 48000);
        const double t = contact_s(radius, mass, young, speed);
        // Half a sine's spectrum at the second and first partial of a tuned bar, of weights 0.35 and 1.
        const auto reach = [&](double f) {
            const double x = 2 * f * t;
            return std::abs(std::cos(std::numbers::pi * x / 2) / (1 - x * x));
        };
        const double ratio = 0.35 * std::pow(3.984, -0.2) * reach(398.4) / reach(100);
        return amplitude(sound, 4800, 24000, 398.4) / amplitude(sound, 4800, 24000, 100) / ratio;
    };
    // The partials fall alike (damping 0), so their ratio is that of the force's spectrum; 5 %: windows and rounding of the contact
    // to samples.
    for (const double speed : {0.5, 2.0, 8.0})
        EXPECT_NEAR(zero_depth(0.006, 0.05, 1e10, speed), 1, 0.05) << speed;
    EXPECT_NEAR(zero_depth(0.02, 0.05, 1e10, 2), 1, 0.05);
    EXPECT_NEAR(zero_depth(0.006, 0.02, 1e10, 2), 1, 0.05);
    EXPECT_NEAR(zero_depth(0.006, 0.05, 2e7, 2), 1, 0.05);
}

TEST(Membrane, ItsLowestModeDiesBeforeThoseWithNodalDiameters) {
    const double f = 120, load = 1.2;
    const auto ratio = [&](double root) {
        return root / 2.404826 * std::sqrt((1 + load / 2.404826) / (1 + load / root));
    };
    const audio::Voice drum = even_voice("drum", {{"frequency_hz", f},
                                                  {"decay_s", 1.5},
                                                  {"damping", 0.8},
                                                  {"hardness", 0.8},
                                                  {"bend_cents", 0},
                                                  {"attack", 0},
                                                  {"air_load", load}});
    const auto sound = strike(drum, 4, 0.55);
    const double t01 = t60_s(sound, f), t11 = t60_s(sound, f * ratio(3.831706)),
                 t21 = t60_s(sound, f * ratio(5.135622)), t31 = t60_s(sound, f * ratio(6.380162));
    std::printf("membrane: T60 of (0,1) %.2f, (1,1) %.2f, (2,1) %.2f, (3,1) %.2f s\n", t01, t11, t21, t31);
    EXPECT_NEAR(t11, 1.5, 0.05);  // decay_s; the neighbours leak into the window
    for (const double other : {t11, t21, t31}) EXPECT_LT(t01, 0.75 * other);
}

TEST(Membrane, AirDrawsItsModesDownByTheMassThatMovesWithThem) {
    for (const double load : {0.0, 1.2, 3.0}) {
        const auto sound = strike(even_voice("drum", {{"frequency_hz", 100},
                                                      {"decay_s", 3},
                                                      {"hardness", 0.7},
                                                      {"bend_cents", 0},
                                                      {"attack", 0},
                                                      {"air_load", load}}),
                                  3, 0.6);
        for (const double root : {3.831706, 5.135622, 6.380162, 7.588342}) {
            const double expected =
                100 * root / 2.404826 * std::sqrt((1 + load / 2.404826) / (1 + load / root));
            // A peak: less beside it, by 1 % of the frequency (a window of 0.4 s tells 5 Hz apart).
            const double at = amplitude(sound, 4800, 38400, expected);
            EXPECT_GT(at, 1.2 * amplitude(sound, 4800, 38400, expected - 4)) << root << " " << load;
            EXPECT_GT(at, 1.2 * amplitude(sound, 4800, 38400, expected + 4)) << root << " " << load;
        }
    }
}

TEST(Membrane, ASecondHeadSplitsTheLowestModesIntoPairs) {
    const auto upper = [](double second) {
        const auto sound = strike(even_voice("drum", {{"frequency_hz", 180},
                                                      {"decay_s", 1},
                                                      {"bend_cents", 0},
                                                      {"attack", 0},
                                                      {"second_head", second}}),
                                  3, 0.2);
        return amplitude(sound, 480, 9600, 180 * 1.81);
    };
    EXPECT_GT(upper(1), 5 * upper(0));
}

TEST(Cymbal, TheBandAbove5KhzPeaks20MsOrMoreAfterTheStroke) {
    for (const Parameters& kind : {Parameters{{"decay_s", 0.16}, {"damping", 0.35}, {"noise", 0.7}},
                                   Parameters{{"decay_s", 2.6}, {"noise", 0.8}},
                                   Parameters{{"decay_s", 4}, {"damping", 0.5}, {"noise", 0.3}}}) {
        for (const double speed : {1.0, 4.0, 8.0}) {
            const auto power = high_band(strike(even_voice("cymbal", kind), speed, 0.6), 5000);
            const auto at = std::ranges::max_element(power) - power.begin();
            const double ms = 1e3 * (64.0 * static_cast<double>(at) + 128) / audio::kSampleRate;
            std::printf("cymbal of %.2f s at %.0f m/s: band above 5 kHz at its peak after %.0f ms\n",
                        kind[0].second, speed, ms);
            EXPECT_GE(ms, 20);
            EXPECT_LE(ms, 200);
        }
    }
}

TEST(Cymbal, ItHasAtLeast400PartialsWhichNoTwoCymbalsShare) {
    // Peaks of the spectrum of 0.7 s: 1.5 Hz apart, so that partials 25 Hz apart are told apart.
    const auto partials = [](double frequency) {
        const auto sound =
            strike(even_voice("cymbal", {{"frequency_hz", frequency}, {"decay_s", 20}, {"damping", 0}}), 8);
        std::vector<double> at;
        double before = 0, here = 0;
        for (double f = 200; f < 18000; f += 4) {
            const double next = amplitude(sound, 9600, 32768, f);
            if (here > before && here > next && here > 3e-6) at.push_back(f - 4);
            before = here, here = next;
        }
        return at;
    };
    const auto crash = partials(330), ride = partials(290);
    std::printf("partials found: %zu and %zu\n", crash.size(), ride.size());
    EXPECT_GE(crash.size(), 400U);
    const auto shared =
        std::ranges::count_if(crash, [&](double f) { return std::ranges::find(ride, f) != ride.end(); });
    EXPECT_LT(shared, static_cast<std::ptrdiff_t>(crash.size() / 2)) << "what chance leaves";
}

TEST(Snare, TheWiresFollowTheHeadAndAreSilentUnderASoftStroke) {
    const auto wires = [](double speed) {  // share of the band above 3 kHz
        Parameters head{{"frequency_hz", 190}, {"decay_s", 0.6}, {"attack", 0}, {"hardness", 0.3}};
        const auto bare = strike(even_voice("drum", head), speed, 0.1, 48000);
        head.emplace_back("snare", 0.8);
        const auto with = strike(even_voice("drum", head), speed, 0.1, 48000);
        double power = 0, all = 0;
        for (std::size_t i = 0; i < with.size(); ++i)
            power += std::pow(with[i] - bare[i], 2), all += bare[i] * bare[i];
        return power / all;
    };
    EXPECT_GT(wires(4), 0.05);
    EXPECT_LT(wires(0.05), 1e-6);  // -68 dBFS of the head: below the threshold
    EXPECT_GT(wires(4), wires(0.3));
}

}  // namespace
