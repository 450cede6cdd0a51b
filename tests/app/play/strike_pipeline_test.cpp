// What pictures add to the bodies' exact states, strike by strike.
#include "play/strike_pipeline.h"

#include <gtest/gtest.h>
#include <malloc.h>

#include <cmath>
#include <random>

namespace app {
namespace {

Strike strike_at(double contact_s, double push = 1) {
    Strike strike;
    strike.id = 1;
    strike.contact_s = contact_s;
    strike.impulse_body = Eigen::Vector3d(0, -push, 0);
    return strike;
}

/// Sum of weight times push over the impulses: what the body shows, in units of the push, plus what is folded
/// into its state.
double shown(const std::vector<sim::WeightedImpulse>& list, double folded = 0) {
    double sum = folded;
    for (const sim::WeightedImpulse& entry : list) sum -= entry.weight * entry.impulse.impulse_body.y();
    return sum;
}

constexpr double kFrame = 1.0 / 30, kLead = 1.0 / 30;

/// A swinging cymbal and one of another name in its choke group.
Kit two_cymbals() {
    Kit kit;
    for (const char* name : {"closed", "open"}) {
        Instrument& cymbal = kit.instruments.emplace_back();
        cymbal.name = name;
        cymbal.voice.choke_group = "hat";
        cymbal.body.shape.semi_axes = {0.2, 0.01, 0.2};
        cymbal.body.stand.hinged = true;
    }
    return kit;
}
const ChokedBodies kUnchoked(two_cymbals(), 0, kLead);

// Small pieces that stay, between those that each sample takes and gives back, leave holes that nothing fits: an hour of
// live play would grow by 3 KiB a strike.
TEST(DrawnStrikes, AStrikeThatIsOverLeavesNoPieceOfItsOwnInMemory) {
    DrawnStrikes drawn;
    const std::size_t before = mallinfo2().uordblks;  // 0 under sanitizers
    for (std::uint64_t id = 1; id <= 10000; ++id) drawn.folded(id);
    EXPECT_LT(mallinfo2().uordblks - before, 65536U)
        << "two bytes a strike, in one row; a piece each is 480000";
}

TEST(DrawnStrikes, AContactIsDrawnFromTheFirstFrameAfterIt) {
    DrawnStrikes drawn;
    const Strike strike = strike_at(0.1);
    EXPECT_EQ(shown(drawn.frame(0.09, std::span(&strike, 1), kUnchoked)), 0);
    EXPECT_EQ(shown(drawn.frame(0.11, std::span(&strike, 1), kUnchoked)), 1);
}

TEST(DrawnStrikes, ACancelledContactFadesWithin100MsWithoutAJump) {
    DrawnStrikes drawn;
    Strike strike = strike_at(0.1);
    double T = 0.11;
    double last = shown(drawn.frame(T, std::span(&strike, 1), kUnchoked));
    strike.outcome = Outcome::cancelled;
    for (int i = 1; i <= 4; ++i) {
        const double now = shown(drawn.frame(T + i * kFrame, std::span(&strike, 1), kUnchoked));
        EXPECT_LE(now, last);
        EXPECT_LE(last - now, kFrame / 0.1 + 1e-9);  // one frame's share of 100 ms
        last = now;
    }
    EXPECT_EQ(last, 0);
}

TEST(DrawnStrikes, ACancelledContactThatWasNeverDrawnShowsNothing) {
    DrawnStrikes drawn;
    Strike strike = strike_at(0.1);
    EXPECT_EQ(shown(drawn.frame(0.05, std::span(&strike, 1), kUnchoked)), 0);
    strike.outcome = Outcome::cancelled;
    EXPECT_TRUE(drawn.frame(0.2, std::span(&strike, 1), kUnchoked).empty());
}

TEST(DrawnStrikes, AReleasedContactThatMovedPassesOverToItsFinalImpulseSmoothlyAlsoWhileItIsFolded) {
    DrawnStrikes drawn;
    Strike strike = strike_at(0.1, 1);
    double last = shown(drawn.frame(0.11, std::span(&strike, 1), kUnchoked));
    strike.impulse_body.y() = -2;  // the last state before the release said 2
    strike.outcome = Outcome::released;
    for (int i = 1; i <= 6; ++i) {
        if (i == 2) drawn.folded(1);
        const double now =
            shown(drawn.frame(0.11 + i * kFrame, std::span(&strike, 1), kUnchoked), i >= 2 ? 2 : 0);
        EXPECT_LE(std::abs(now - last), kFrame / 0.1 + 1e-9);
        last = now;
    }
    EXPECT_EQ(last, 2);
    EXPECT_TRUE(drawn.frame(0.5, std::span(&strike, 1), kUnchoked).empty())
        << "settled: the exact state says it all";
}

TEST(DrawnStrikes, AnUnmovedReleasedContactAddsNothingOnceItIsFolded) {
    DrawnStrikes drawn;
    Strike strike = strike_at(0.1);
    (void)drawn.frame(0.11, std::span(&strike, 1), kUnchoked);
    strike.outcome = Outcome::released;
    drawn.folded(1);
    EXPECT_TRUE(drawn.frame(0.11 + kFrame, std::span(&strike, 1), kUnchoked).empty());
}

audio::Note choke_at(double t_s, std::uint32_t voice = 0, audio::Note::Kind kind = audio::Note::Kind::choke) {
    audio::Note note;
    note.voice = voice;
    note.onset_sample = std::llround(t_s * audio::kSampleRate);
    note.kind = kind;
    return note;
}

TEST(ChokedBodies, AChokedBodyComesToRestWithin100MsOfTheFrameThatMayKnowWithoutAJump) {
    struct Case {
        double at_s, known_s;
    };
    for (const Case& each : {Case{0.5, -INFINITY}, {0.5, 0.49}, {0.5, 0.3}}) {
        ChokedBodies choked(two_cymbals(), 0, kLead);
        choked.take(choke_at(each.at_s), each.known_s);
        const sim::Impulse before{0, 0.4999, {}, {0, -1, 0}}, after{0, 0.5001, {}, {0, -1, 0}},
            other{1, 0.4, {}, {0, -1, 0}};
        const double begins = std::max(each.at_s, each.known_s + kLead);
        double last = 1;
        for (double T = 0.4; T < 0.8; T += 0.001) {
            const double now = choked.weight(before, T);
            EXPECT_LE(now, last);
            EXPECT_LE(last - now, 1.5 * 0.001 / 0.1 + 1e-9) << "the greatest slope of 3 x^2 - 2 x^3";
            if (T <= begins) {
                EXPECT_EQ(now, 1) << T;
            } else if (T >= begins + 0.1) {
                EXPECT_EQ(now, 0) << T;
            }
            EXPECT_EQ(choked.weight(after, T), 1);
            EXPECT_EQ(choked.weight(other, T), 1);
            last = now;
        }
    }
}

TEST(ChokedBodies, AStrokeEndsTheMotionOfTheOthersOfItsGroupAlone) {
    ChokedBodies choked(two_cymbals(), 0, kLead);
    choked.take(choke_at(0.5, 1, audio::Note::Kind::stroke), 0.45);
    EXPECT_EQ(choked.weight({0, 0.4, {}, {}}, 0.7), 0);
    EXPECT_EQ(choked.weight({1, 0.4, {}, {}}, 0.7), 1);
    choked.take(choke_at(0.5, 1, audio::Note::Kind::pedal), 0.45);
    EXPECT_EQ(choked.weight({1, 0.4, {}, {}}, 0.7), 1);
}

// The sum of the exact state and of what frames add is what is seen: it goes to rest once and for all, also where strikes
// are first seen, moved, folded and choked in any order, and never by more than the slopes of both fades.
TEST(DrawnStrikes, WhatIsSeenOfChokedStrikesNeverJumpsAndEndsAtRest) {
    std::mt19937 random(1);
    const auto between = [&](double low, double high) {
        return low + (high - low) * std::generate_canonical<double, 53>(random);
    };
    for (int run = 0; run < 300; ++run) {
        DrawnStrikes drawn;
        ChokedBodies choked(two_cymbals(), 0, kLead);
        Strike strike = strike_at(0.2 + between(0, 0.02), 1);
        const double released_s = strike.contact_s - 0.01, choke_s = between(0.2, 0.5),
                     moved = run % 3 == 0 ? between(0.5, 1.5) : 1;
        const double known_s = choke_s - (run % 2 == 0 ? 0.01 : 1);
        bool told = false, folded = false;
        double exact = 0, last = 0;
        for (double T = 0.15; T < 1; T += 0.005) {
            const double s = T - kLead;
            if (s >= released_s && strike.outcome == Outcome::pending) {
                strike.outcome = Outcome::released;
                strike.impulse_body.y() = -moved;
            }
            if (s >= known_s && !told) choked.take(choke_at(choke_s), known_s);
            told = told || s >= known_s;
            if (s >= strike.contact_s && !folded) {
                drawn.folded(1);
                choked.folded({1, impulse_of(strike)});
                exact += moved;
                folded = true;
            }
            for (const ChokedBodies::Folded& stopped : choked.take_stopped(s)) {
                exact += stopped.impulse.impulse_body.y();
                drawn.stopped(stopped.id);
            }
            const double now = shown(drawn.frame(T, std::span(&strike, 1), choked), exact);
            const bool struck = T >= strike.contact_s && T - 0.005 < strike.contact_s;
            if (!struck) {
                EXPECT_LE(std::abs(now - last), 1.5 * (0.005 / 0.1 + 1.5 * 0.005 / 0.1) + 1e-9)
                    << run << " " << T;
            }
            last = now;
        }
        const bool rings = strike.contact_s >= choke_s;
        EXPECT_NEAR(last, rings ? moved : 0, 1e-12) << run;
        EXPECT_NEAR(exact, last, 1e-12) << run << ": contacts find what is seen";
    }
}

}  // namespace
}  // namespace app
