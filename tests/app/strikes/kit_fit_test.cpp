#include "strikes/kit_fit.h"

#include <gtest/gtest.h>
#include <sim/simulation.h>

#include <cmath>
#include <numbers>

#include "files/assets.h"
#include "files/bad_input.h"
#include "kit/drum_score.h"
#include "kit/kit.h"
#include "strikes/stroke_lows.h"
#include "strikes/true_contacts.h"
#include "written_kit.h"

namespace app {
namespace {

constexpr double kRateHz = 240;

/// A trace of tips (no orientation, tip = tracked point): height_at(t) over a place.
tracking::StickTrace stick_of(const std::string& name, double duration,
                              const std::function<Eigen::Vector3d(double)>& tip_at) {
    tracking::StickTrace stick{name, {}};
    for (int i = 0; i < static_cast<int>(duration * kRateHz); ++i) {
        tracking::PoseSample sample;
        sample.t_s = i / kRateHz;
        sample.position = tip_at(sample.t_s);
        stick.samples.push_back(sample);
    }
    return stick;
}

TipTrack track_of(const tracking::StickTrace& stick) {
    tracking::Trace trace;
    trace.sticks = {stick};
    return tip_tracks(trace, {}).front();
}

/// Bounces like a ball on a head at `head`: parabolas of 0.2 m, which meet it at 1 m/s and more.
Eigen::Vector3d bouncing(double t, double x, double z, double head) {
    constexpr double kPeriod = 0.5, kRise = 0.2;
    const double u = std::fmod(t + kPeriod / 2, kPeriod) / kPeriod * 2 - 1;
    return {x, head + kRise * (1 - u * u), z};
}

/// Swings down and up along a sine; each swing ends at a height of its own between low and low + spread.
Eigen::Vector3d swinging(double t, double x, double z, double low, double spread) {
    constexpr double kPeriod = 0.5, kRise = 0.8;
    const double swing = std::floor(t / kPeriod);
    const double bottom = low + spread * std::fmod(swing * 0.618, 1.0);
    const double top = low + spread + kRise;
    return {x, bottom + (top - bottom) * (0.5 + 0.5 * std::cos(2 * std::numbers::pi * t / kPeriod)), z};
}

tracking::Trace trace_of(std::vector<tracking::StickTrace> sticks) {
    tracking::Trace trace;
    trace.file = "test.csv";
    trace.sticks = std::move(sticks);
    return trace;
}

TEST(StrokeLows, AFallOf26MillimetresIsAStrokeOneOf24IsNot) {
    for (const double fall : {0.024, 0.026}) {
        const TipTrack track = track_of(stick_of("a", 4, [&](double t) {
            return Eigen::Vector3d(0, 1 + fall / 2 * std::cos(2 * std::numbers::pi * t), 0);
        }));
        EXPECT_EQ(find_lows(track).size(), fall > 0.025 ? 4u : 0u) << fall;
    }
}

TEST(StrokeLows, AStickThatOnlyFallsOrOnlyRisesMakesNone) {
    for (const double sign : {-1.0, 1.0})
        EXPECT_TRUE(find_lows(track_of(stick_of("a", 1, [&](double t) {
                        return Eigen::Vector3d(0, sign * t, 0);
                    }))).empty());
}

TEST(StrokeLows, NothingIsJoinedAcrossAGap) {
    tracking::StickTrace stick =
        stick_of("a", 1, [](double t) { return Eigen::Vector3d(0, std::abs(t - 0.5), 0); });
    EXPECT_EQ(find_lows(track_of(stick)).size(), 1u);
    std::erase_if(stick.samples,
                  [](const tracking::PoseSample& sample) { return std::abs(sample.t_s - 0.5) < 0.06; });
    EXPECT_TRUE(find_lows(track_of(stick)).empty());
}

TEST(StrokeLows, ABounceTurnsWithinTheWindowASwingDoesNot) {
    for (const Low& low :
         find_lows(track_of(stick_of("a", 4, [](double t) { return bouncing(t, 0, 0, 0.8); })))) {
        EXPECT_NEAR(low.descent_mps, 1.6, 0.05);  // 4 * 0.2 / 0.5
        // The slope jumps from -v to v; seen across +-9 ms (2 samples of 4.17 ms and more: 12.5 ms) that
        // takes half the window.
        EXPECT_LT(low.turning_s, 0.010);
        EXPECT_NEAR(low.tip.y(), 0.8, 1.7 / kRateHz / 2);  // the sample nearest the bounce
    }
    for (const Low& low :
         find_lows(track_of(stick_of("a", 4, [](double t) { return swinging(t, 0, 0, 0.5, 0); }))))
        EXPECT_NEAR(low.turning_s, 0.5 / (2 * std::numbers::pi), 0.005);  // v / a = 1 / omega
}

TEST(StrokeLows, ContactHeightIsTheMedianOfTheLowsWithin50MillimetresOfTheLowest) {
    std::vector<Low> lows(5);
    const double heights[] = {0.80, 0.81, 0.83, 0.86, 1.2};
    for (std::size_t i = 0; i < 5; ++i) lows[i].tip.y() = heights[i];
    EXPECT_EQ(contact_height(lows), 0.81);
}

TEST(KitFit, TwoHeadsStruckByTwoSticksBecomeTwoInstruments25MillimetresAboveTheirContactHeights) {
    const tracking::Trace trace =
        trace_of({stick_of("left", 10, [](double t) { return bouncing(t, -0.3, -0.5, 0.80); }),
                  stick_of("right", 10, [](double t) { return bouncing(t + 0.1, 0.3, -0.4, 0.70); })});
    const KitFit fit = fit_kit(std::span(&trace, 1), {});
    ASSERT_EQ(fit.instruments.size(), 2u);
    constexpr double kX[] = {-0.3, 0.3}, kZ[] = {-0.5, -0.4}, kHead[] = {0.80, 0.70};
    for (std::size_t i = 0; i < 2; ++i) {
        const FittedInstrument& instrument = fit.instruments[i];
        EXPECT_TRUE(instrument.struck);
        EXPECT_NEAR(instrument.met.x(), kX[i], 1e-9);
        EXPECT_NEAR(instrument.met.z(), kZ[i], 1e-9);
        EXPECT_NEAR(instrument.contact_height_m, kHead[i], 0.004);  // samples 4.2 ms apart at 1.6 m/s
        EXPECT_DOUBLE_EQ(instrument.met.y(), instrument.contact_height_m + 0.025);
        EXPECT_EQ(instrument.entering, instrument.strokes);
        EXPECT_GE(instrument.strokes, 18);
    }
    EXPECT_TRUE(fit.towards_player.isApprox(Eigen::Vector3d(-0.1, 0, 0.6).normalized(),
                                            1e-6));  // across the line of the hands
}

TEST(KitFit, SwingsWithNothingUnderThemAreMetWhereTheyAreFastest) {
    const tracking::Trace trace =
        trace_of({stick_of("a", 20, [](double t) { return swinging(t, 0.1, -0.3, 0.5, 0.3); })});
    const KitFit fit = fit_kit(std::span(&trace, 1), {});
    ASSERT_EQ(fit.instruments.size(), 1u);
    EXPECT_FALSE(fit.instruments[0].struck);
    // Lows are spread evenly over 0.5 to 0.8 (multiples of the golden ratio), the tops lie at 1.6: swings are fastest
    // midway, at 1.05 to 1.2, far above all lows.
    EXPECT_NEAR(fit.instruments[0].met.y(), 1.125, 0.03);
    EXPECT_EQ(fit.instruments[0].entering, fit.instruments[0].strokes);
}

TEST(KitFit, SwaysBetweenSwingsMakeNoInstrument) {
    const tracking::Trace trace =
        trace_of({stick_of("a", 20, [](double t) { return swinging(t, 0.1, -0.3, 0.5, 0.3); }),
                  stick_of("b", 20, [](double t) {
                      return Eigen::Vector3d(0.6, 0.4 + 0.03 * std::cos(2 * std::numbers::pi * t), 0.4);
                  })});
    const KitFit fit = fit_kit(std::span(&trace, 1), {});
    ASSERT_EQ(fit.instruments.size(), 1u);
    EXPECT_NEAR(fit.instruments[0].met.x(), 0.1, 1e-6);
    EXPECT_NEAR(fit.instruments[0].met.z(), -0.3, 1e-6);
}

/// Swings down at a place of its own each, from -0.5 to 0.5.
Eigen::Vector3d scattered(double t, const std::function<double(double)>& place) {
    constexpr double kPeriod = 0.5;
    return swinging(t, place(std::fmod(std::floor(t / kPeriod) * 0.618, 1.0)), -0.3, 0.5, 0.3);
}

TEST(KitFit, SwingsThatAreApartHaveAnInstrumentEachThoseThatAreEverywhereShareOne) {
    const auto fit = [](const std::function<double(double)>& place) {
        const tracking::Trace trace =
            trace_of({stick_of("a", 60, [&](double t) { return scattered(t, place); })});
        return fit_kit(std::span(&trace, 1), {}).instruments;
    };
    const auto apart = fit([](double share) { return (share < 0.5 ? -0.4 : 0.4) + 0.1 * share; });
    ASSERT_EQ(apart.size(), 2u);
    for (const FittedInstrument& instrument : apart) EXPECT_LT(instrument.radius_m, 0.2);
    // Of swings that lie evenly along 1 m, at 5 m/s, each edge of a small disc has 30 mm beside it that none can tell
    // from it 6 ms before: 3 % of the swings.
    const auto everywhere = fit([](double share) { return share - 0.5; });
    ASSERT_LE(everywhere.size(), 2u);
    double covered_m = 0;
    for (const FittedInstrument& instrument : everywhere) covered_m += 2 * instrument.radius_m;
    EXPECT_GT(covered_m, 0.8);
}

TEST(KitFit, SwingsBehindTheHandAreBackswings) {
    // The tip turns about a hand: down in front, fast, and down behind, over the shoulder, as fast.
    const auto swings = [](bool behind) {
        tracking::StickTrace stick{"a", {}};
        for (int i = 0; i < 2400; ++i) {
            tracking::PoseSample sample;
            sample.t_s = i / kRateHz;
            sample.position = {0, 1.2, 0};
            const double degrees =
                behind ? 120 + 50 * std::cos(8 * sample.t_s) : 10 + 60 * std::cos(8 * sample.t_s);
            sample.orientation =
                Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Eigen::Vector3d::UnitX());
            sample.has_orientation = true;
            stick.samples.push_back(sample);
        }
        return stick;
    };
    const tracking::Trace trace = trace_of({swings(false), swings(true)});
    StickGeometry geometry;
    geometry.tip = {0, 0, -0.35};
    const KitFit fit = fit_kit(std::span(&trace, 1), geometry);
    ASSERT_FALSE(fit.instruments.empty());
    for (const FittedInstrument& instrument : fit.instruments) EXPECT_LT(instrument.met.z(), -0.2);
}

TEST(KitFit, AStrayLowBeneathTheHeadDoesNotHideIt) {
    tracking::StickTrace stick = stick_of("a", 10, [](double t) { return bouncing(t, 0, 0, 0.8); });
    const tracking::StickTrace dropped =
        stick_of("b", 1, [](double t) { return Eigen::Vector3d(0.05, 0.3 + std::abs(t - 0.5), 0); });
    const tracking::Trace trace = trace_of({stick, dropped});
    const KitFit fit = fit_kit(std::span(&trace, 1), {});
    ASSERT_EQ(fit.instruments.size(), 1u);
    EXPECT_TRUE(fit.instruments[0].struck);
    EXPECT_NEAR(fit.instruments[0].contact_height_m, 0.8, 0.004);
}

TEST(KitFit, InstrumentsDoNotOverlapHoweverNearTheStrokes) {
    std::vector<tracking::StickTrace> sticks;
    for (int i = 0; i < 9; ++i)
        sticks.push_back(stick_of(std::string(1, static_cast<char>('a' + i)), 4, [i](double t) {
            return bouncing(t, 0.23 * (i % 3) + 0.02 * std::sin(40 * t), 0.23 * (i / 3), 0.8);
        }));
    const tracking::Trace trace = trace_of(std::move(sticks));
    const KitFit fit = fit_kit(std::span(&trace, 1), {});
    ASSERT_GE(fit.instruments.size(), 4u);
    for (const FittedInstrument& a : fit.instruments)
        for (const FittedInstrument& b : fit.instruments)
            if (&a != &b) {
                EXPECT_GT((a.met - b.met).norm(), a.radius_m + b.radius_m);
            }
}

TEST(KitFit, OneStrokeIsEnoughNoneIsBadInput) {
    const tracking::Trace one =
        trace_of({stick_of("a", 1, [](double t) { return Eigen::Vector3d(0, std::abs(t - 0.5), 0); })});
    EXPECT_EQ(fit_kit(std::span(&one, 1), {}).instruments.size(), 1u);
    const tracking::Trace none =
        trace_of({stick_of("a", 1, [](double) { return Eigen::Vector3d(0, 1, 0); })});
    try {
        (void)fit_kit(std::span(&none, 1), {});
        FAIL();
    } catch (const BadInput& wrong) {
        EXPECT_EQ(std::string(wrong.what()).find("test.csv: error: found no stroke"), 0u) << wrong.what();
    }
}

TEST(KitFit, BackswingsOverTheHandAreNoStrokes) {
    // The tip is 0.35 m along body -z of a hand that turns about x: it passes low in front and high behind.
    tracking::StickTrace stick{"a", {}};
    for (int i = 0; i < 2400; ++i) {
        tracking::PoseSample sample;
        sample.t_s = i / kRateHz;
        sample.position = {0, 1.2, 0};
        // From 160 degrees (up and back, beyond the top) to -60 degrees (down in front, not to the bottom)
        // and back.
        const double angle = (50 + 110 * std::cos(4 * sample.t_s)) * std::numbers::pi / 180;
        sample.orientation = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX());
        sample.has_orientation = true;
        stick.samples.push_back(sample);
    }
    const tracking::Trace trace = trace_of({stick});
    StickGeometry geometry;
    geometry.tip = {0, 0, -0.35};
    EXPECT_GT(find_lows(tip_tracks(trace, geometry)[0]).size(), 10u);
    const KitFit fit = fit_kit(std::span(&trace, 1), geometry);
    // In front, where the tip comes down; behind the hand it turns over the top.
    for (const FittedInstrument& instrument : fit.instruments) EXPECT_LT(instrument.met.z(), -0.1);
}

TEST(KitFit, TheWrittenKitIsValidAndItsHeadLiesTheTipsRadiusBelowTheMetSurface) {
    const tracking::Trace trace =
        trace_of({stick_of("left", 10, [](double t) { return bouncing(t, -0.3, -0.5, 0.80); })});
    StickGeometry geometry;
    geometry.radius_m = 0.02;
    const KitFit fit = fit_kit(std::span(&trace, 1), geometry);
    for (const char* kind : {"drum", "cymbal", "bell"}) {
        const WrittenKit written(
            format_fitted_kit(fit, kind, "odd \"name\"\n\\.csv", geometry, kind[0] == 'd'));
        const Kit kit = written.read();
        ASSERT_EQ(kit.instruments.size(), 1u);
        EXPECT_EQ(kit.stick.radius_m, 0.02);
        EXPECT_EQ(kit.stick.tip.has_value(), kind[0] == 'd');
        const double distance =
            sim::rest_distance(kit.instruments[0].body, fit.instruments[0].met, 0.02).distance;
        EXPECT_NEAR(distance, 0, 2e-4) << kind;  // positions are written to 0.1 mm
    }
}

TEST(KitFit, OnTheTraceOfABundledScoreEveryStrokeOnAFittedHeadIsATrueContact) {
    const Kit drums = read_kit(find_kit("drums"));
    SyntheticSensor sensor;
    sensor.rate_hz = 240;
    const tracking::Trace trace = synthesise_score("roll", drums, sensor);
    const StickGeometry geometry = stick_geometry(trace, {}, {}, {});
    const KitFit fit = fit_kit(std::span(&trace, 1), geometry);
    ASSERT_EQ(fit.instruments.size(), 1u);
    EXPECT_TRUE(fit.instruments[0].struck);
    const WrittenKit written(format_fitted_kit(fit, "drum", "roll", geometry, false));
    const Kit kit = written.read();
    const std::vector<TipTrack> tracks = tip_tracks(trace, geometry);
    const std::size_t contacts =
        find_true_contacts(tracks, std::span(&kit.instruments[0].body, 1), geometry.radius_m).size();
    // Strokes that rise by 25 mm and more; the fast ones in between may come down before they leave the
    // raised surface.
    EXPECT_GE(contacts, static_cast<std::size_t>(fit.instruments[0].entering));
    EXPECT_EQ(fit.instruments[0].entering, fit.instruments[0].strokes);
}

}  // namespace
}  // namespace app
