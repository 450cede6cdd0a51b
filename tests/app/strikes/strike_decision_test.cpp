// Decisions between a path and a network that are told what to expect of a tip that swings over a floor.
#include "strikes/strike_decision.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

namespace {

using app::StrikeDecision;

constexpr double kSwingS = 0.25, kReachS = 1.0 / 15, kMarginS = 0.01, kRateHz = 60;
constexpr double kSwingM = 0.05, kLowM = 0.02;  // the lowest point is so far below or over the floor

/// What one of the two expects of a swing: how far off in time, or nothing.
using Expects = std::function<std::optional<double>(int swing)>;
std::optional<double> nothing(int /*swing*/) {
    return std::nullopt;
}

/// Swings each of which strikes or not.
struct Player {
    std::function<bool(int)> strikes = [](int) { return true; };
    Expects path = nothing, network = nothing;
    double false_cost = 1;
    int swings = 40;
    int silence_after = -1;                            ///< the samples begin anew after this swing
    bool known = false;                                ///< the motion
    std::optional<tracking::ContactTimes> times = {};  ///< as the network says at every sample

    [[nodiscard]] double height(double t_s) const {
        const int swing = static_cast<int>(t_s / kSwingS);
        const double middle = strikes(swing) ? kSwingM - kLowM : kSwingM + kLowM;
        return middle + kSwingM * std::cos(2 * std::numbers::pi * (t_s / kSwingS - swing));
    }
    /// When a swing meets the floor, or would.
    [[nodiscard]] static double meets_s(int swing) {
        return kSwingS * (swing + std::acos(-(kSwingM - kLowM) / kSwingM) / (2 * std::numbers::pi));
    }

    /// What sounds of each swing, when the note is fixed: its time less meets_s(); and what is kept.
    struct Heard {
        std::optional<double> late_s;
        bool kept = false;
    };
    [[nodiscard]] std::vector<Heard> play() const {
        StrikeDecision decision(1, false_cost, kMarginS);
        std::vector<Heard> heard(static_cast<std::size_t>(swings));
        for (int i = 0; i / kRateHz < swings * kSwingS; ++i) {
            const double s = i / kRateHz, height_m = height(s);
            const int swing = static_cast<int>(s / kSwingS);
            if (swing == silence_after + 1 && static_cast<int>((s - 1 / kRateHz) / kSwingS) == silence_after)
                decision.restart();
            app::ExpectedStrikes expected{s, 1 / kRateHz, {&height_m, 1}, {&height_m, 1}};
            const auto contacts = [&](const Expects& by) {
                std::vector<sim::Contact> all;
                const std::optional<double> off_s = by(swing);
                if (!off_s || height_m <= 0 || meets_s(swing) < s) return all;
                if (const double t_s = std::max(s, meets_s(swing) + *off_s); t_s < s + kReachS)
                    all.emplace_back().t_s = t_s;
                return all;
            };
            expected.known = known;
            expected.times = {&times, 1};
            expected.path = expected.confirmed = contacts(path);
            expected.network = contacts(network);
            const app::DecidedStrikes decided = decision.after(expected);
            if (height_m <= 0 || meets_s(swing) < s || meets_s(swing) > s + kMarginS + 1 / kRateHz) continue;
            Heard& of = heard[static_cast<std::size_t>(swing)];
            of.kept = !decided.kept.empty();
            of.late_s.reset();
            if (!decided.sounding.empty() && decided.sounding.front().t_s >= decided.silent_until_s.front())
                of.late_s = decided.sounding.front().t_s - meets_s(swing);
        }
        return heard;
    }
};

Expects always(double off_s) {
    return [off_s](int) { return std::optional(off_s); };
}

TEST(StrikeDecision, ANetworkThatSeesNothingSilencesNothing) {
    for (const Player::Heard& heard : Player{.path = always(0)}.play()) EXPECT_TRUE(heard.late_s);
}

TEST(StrikeDecision, TimesAreThePathsUntilTheNetworksHaveTurnedOutBetter) {
    const auto better = Player{.path = always(0.008), .network = always(0.002)}.play();
    EXPECT_NEAR(*better.front().late_s, 0.008, 1e-9) << "one begins with the path";
    EXPECT_NEAR(*better.back().late_s, 0.002, 1e-9);
    for (const auto& heard : Player{.path = always(0.002), .network = always(0.008)}.play())
        EXPECT_NEAR(heard.late_s.value_or(1), 0.002, 1e-9);
}

TEST(StrikeDecision, WhatTheNetworkAloneExpectsSoundsOnceItHasComeOften) {
    const auto right = Player{.network = always(0)}.play();
    EXPECT_FALSE(right.front().late_s);
    EXPECT_TRUE(right.back().late_s);
    const auto wrong = Player{.strikes = [](int) { return false; }, .network = always(0)}.play();
    for (const Player::Heard& heard : wrong) EXPECT_FALSE(heard.late_s || heard.kept);
}

TEST(StrikeDecision, ACostOfFalseSoundsSilencesWhatComesTooSeldom) {
    const auto half = [](double false_cost) {
        const Player player{
            .strikes = [](int swing) { return swing % 2 == 0; }, .path = always(0), .false_cost = false_cost};
        return player.play();
    };
    for (const Player::Heard& heard : half(1)) EXPECT_TRUE(heard.late_s);
    const auto dear = half(5);  // a share over 5/6 sounds; of all strikes half come
    EXPECT_TRUE(dear.front().late_s);
    EXPECT_FALSE(dear.back().late_s);
    EXPECT_TRUE(dear.back().kept);
}

TEST(StrikeDecision, SilenceEndsWhenStrikesComeAgain) {
    const Player player{
        .strikes = [](int swing) { return swing >= 40; }, .path = always(0), .false_cost = 2, .swings = 70};
    const auto heard = player.play();
    EXPECT_FALSE(heard[39].late_s);
    EXPECT_TRUE(heard[69].late_s);
}

TEST(StrikeDecision, WhatItHasLearnedOutlastsGaps) {
    const auto heard = Player{.path = always(0.008), .network = always(0.002), .silence_after = 20}.play();
    EXPECT_NEAR(*heard[22].late_s, 0.002, 1e-9);
}

TEST(StrikeDecision, OfAKnownMotionTheNetworkIsHeardFromTheFirstStrike) {
    const auto better = Player{.path = always(0.008), .network = always(0.002), .known = true}.play();
    EXPECT_NEAR(better.front().late_s.value_or(1), 0.002, 1e-9);
    const auto alone = Player{.network = always(0), .known = true}.play();
    EXPECT_TRUE(alone.front().late_s);
    // Where it turns out wrong it is heard no longer: by its times, and by what does not come.
    const auto worse = Player{.path = always(0.002), .network = always(0.008), .known = true}.play();
    EXPECT_NEAR(worse.back().late_s.value_or(1), 0.002, 1e-9);
    const auto wrong =
        Player{.strikes = [](int) { return false; }, .network = always(0), .known = true}.play();
    EXPECT_FALSE(wrong.back().late_s);
}

TEST(StrikeDecision, AStrikeThatFellSilentAndComesSoundsLateOnceTheTipIsSeenInTheSurface) {
    StrikeDecision decision(1, 100, kMarginS);
    const auto after = [&](double s, double height_m) {
        app::ExpectedStrikes expected{s, 1 / kRateHz, {&height_m, 1}, {&height_m, 1}};
        expected.path.emplace_back().t_s = std::max(s, 0.095);
        expected.confirmed = expected.path;
        const app::DecidedStrikes decided = decision.after(expected);
        EXPECT_EQ(decided.sounding.size(), 1U) << "it is cancelled only when its note is to be fixed";
        return decided.sounding.front().t_s >= decided.silent_until_s.front();
    };
    for (int i = 0; i < 6; ++i)
        EXPECT_FALSE(after(i / kRateHz, 0.1 - 0.016 * i)) << "99 of 100 would have to come";
    EXPECT_TRUE(after(6 / kRateHz, -0.002)) << "here it is";
}

/// A contact with probability p, within the next 1/60 s.
tracking::ContactTimes soon(double p) {
    tracking::ContactTimes times;
    for (std::size_t i = 0; i < times.before.size(); ++i)
        times.before[i] = p * std::min(1.0, static_cast<double>(i) / 2);
    return times;
}

TEST(StrikeDecision, OfAKnownMotionTheNetworkSilencesWhatItHoldsForUnlikely) {
    const auto first_sounds = [](double p, double false_cost, bool known) {
        const Player player{.path = always(0), .false_cost = false_cost, .known = known, .times = soon(p)};
        return player.play().front().late_s.has_value();
    };
    // The path's odds are 19; with those of the network, p / (1 - p), they have to be over the cost.
    EXPECT_TRUE(first_sounds(0.06, 1, true));
    EXPECT_FALSE(first_sounds(0.04, 1, true));
    EXPECT_TRUE(first_sounds(0.2, 4, true));
    EXPECT_FALSE(first_sounds(0.15, 4, true));
    EXPECT_TRUE(first_sounds(0.04, 1, false)) << "a network of another motion silences nothing";
}

TEST(StrikeDecision, AStickThatPassesRightThroughBetweenTwoSamplesHasStruck) {
    // It falls at 20 m/s through something thin, 40 times, and no sample finds it inside. With a cost of 3 what comes in
    // less than three quarters falls silent.
    for (const bool seen : {true, false}) {
        StrikeDecision decision(1, 3, kMarginS);
        int sounded = 0;
        for (int i = 0; i < static_cast<int>(40 * kSwingS * kRateHz); ++i) {
            const double s = i / kRateHz, meets = kSwingS * std::floor(s / kSwingS) + 0.13;
            const double height_m = std::max(0.01, std::min(1.0, 20 * std::abs(meets - s)));
            app::ExpectedStrikes expected{s, 1 / kRateHz, {&height_m, 1}, {&height_m, 1}};
            sim::Contact contact;
            contact.t_s = meets;
            contact.zone = 0;
            contact.speed_mps = 20;
            if (meets > s && meets < s + kReachS) expected.path = expected.confirmed = {contact};
            if (seen && meets <= s && meets > s - 1 / kRateHz) expected.passed = {contact};
            const app::DecidedStrikes decided = decision.after(expected);
            const bool sounds =
                !decided.sounding.empty() && decided.sounding.front().t_s >= decided.silent_until_s.front();
            sounded += sounds && meets > s && meets <= s + 1 / kRateHz;
        }
        if (seen)
            EXPECT_EQ(sounded, 40);
        else
            EXPECT_LT(sounded, 20);
    }
}

}  // namespace
