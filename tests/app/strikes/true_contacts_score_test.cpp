#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "statistics/statistics.h"
#include "strikes/true_contacts.h"

namespace {

app::Strike note(std::uint64_t id, double onset_s, std::uint32_t stick = 0, std::uint32_t instrument = 0) {
    app::Strike strike;
    strike.id = id;
    strike.onset_s = onset_s;
    strike.stick = stick;
    strike.instrument = instrument;
    strike.outcome = app::Outcome::released;
    return strike;
}

app::TrueContact contact(double t_s, std::uint32_t stick = 0, std::uint32_t instrument = 0) {
    app::TrueContact c;
    c.t_s = t_s;
    c.stick = stick;
    c.instrument = instrument;
    return c;
}

TEST(ScoreStrikes, ANote4MsLateIsMatchedAndItsErrorIsTheTiming) {
    std::vector<app::TrueContact> contacts = {contact(1.0)};
    const app::StrikeScore score = app::score_strikes({note(7, 1.004)}, contacts);
    EXPECT_EQ(contacts[0].matched_id, 7U);
    EXPECT_EQ(score.true_contacts, 1);
    EXPECT_EQ(score.released, 1);
    EXPECT_EQ(score.false_notes, 0);
    EXPECT_EQ(score.missed, 0);
    EXPECT_NEAR(score.timing_median_ms, 4, 1e-9);  // one rounding of times near 1 s
    EXPECT_NEAR(score.timing_p95_ms, 4, 1e-9);
}

TEST(ScoreStrikes, ThirtyMillisecondsMatchAndThirtyOneDoNot) {
    for (const double sign : {-1.0, 1.0}) {
        std::vector<app::TrueContact> contacts = {contact(1.0)};
        EXPECT_EQ(app::score_strikes({note(1, 1.0 + sign * 0.030)}, contacts).missed, 0) << sign;
        const app::StrikeScore beyond = app::score_strikes({note(1, 1.0 + sign * 0.031)}, contacts);
        EXPECT_EQ(beyond.missed, 1) << sign;
        EXPECT_EQ(beyond.false_notes, 1) << sign;
        EXPECT_EQ(contacts[0].matched_id, 0U) << "an older match is forgotten";
    }
}

TEST(ScoreStrikes, AnotherSticksOrInstrumentsNoteDoesNotMatch) {
    std::vector<app::TrueContact> contacts = {contact(1.0, 0, 0)};
    EXPECT_EQ(app::score_strikes({note(1, 1.0, 1, 0), note(2, 1.0, 0, 1)}, contacts).missed, 1);
}

TEST(ScoreStrikes, OfTwoNotesForOneContactTheCloserIsTheTrueOne) {
    std::vector<app::TrueContact> contacts = {contact(1.0)};
    const app::StrikeScore score = app::score_strikes({note(1, 0.990), note(2, 1.005)}, contacts);
    EXPECT_EQ(contacts[0].matched_id, 2U);
    EXPECT_EQ(score.false_notes, 1);
}

TEST(ScoreStrikes, TheClosestPairGoesFirstEvenIfAnotherContactIsMissedForIt) {
    std::vector<app::TrueContact> contacts = {contact(1.000), contact(1.020)};
    const app::StrikeScore score = app::score_strikes({note(1, 1.018), note(2, 1.045)}, contacts);
    EXPECT_EQ(contacts[0].matched_id, 0U);
    EXPECT_EQ(contacts[1].matched_id, 1U);
    EXPECT_EQ(score.false_notes, 1);
}

TEST(ScoreStrikes, EquallyClosePairsGoByContactTimeThenById) {
    // Binary fractions, so that the distances are equal to the bit.
    std::vector<app::TrueContact> two = {contact(1.0), contact(1.0 + 1.0 / 64)};
    (void)app::score_strikes({note(1, 1.0 + 1.0 / 128)}, two);
    EXPECT_EQ(two[0].matched_id, 1U);
    EXPECT_EQ(two[1].matched_id, 0U);
    std::vector<app::TrueContact> one = {contact(1.0)};
    (void)app::score_strikes({note(9, 1.0 - 1.0 / 128), note(4, 1.0 + 1.0 / 128)}, one);
    EXPECT_EQ(one[0].matched_id, 4U);
}

TEST(ScoreStrikes, CancelledNotesAreCountedButNeitherTrueNorFalseNorMoved) {
    std::vector<app::Strike> strikes = {note(1, 1.0), note(2, 2.0), note(3, 3.0)};
    strikes[0].moves = 3;
    strikes[1].moves = 5;
    strikes[1].outcome = app::Outcome::cancelled;
    std::vector<app::TrueContact> contacts = {contact(1.0), contact(2.0)};
    const app::StrikeScore score = app::score_strikes(strikes, contacts);
    EXPECT_EQ(score.released, 2);
    EXPECT_EQ(score.cancelled, 1);
    EXPECT_EQ(score.moved, 1);
    EXPECT_EQ(score.false_notes, 1);
    EXPECT_EQ(score.missed, 1);
}

TEST(ScoreStrikes, NothingAtAllGivesZerosAndNoTimes) {
    std::vector<app::TrueContact> contacts;
    const app::StrikeScore score = app::score_strikes({}, contacts);
    EXPECT_EQ(score.true_contacts + score.released + score.missed + score.false_notes, 0);
    EXPECT_TRUE(std::isnan(score.timing_median_ms));
    EXPECT_TRUE(std::isnan(score.timing_p95_ms));
}

/// For 200 random takes: the matching is one to one, within the window, leaves no pair that could still be
/// made, does not depend on the order of the strikes, and the counts add up.
TEST(ScoreStrikes, RandomTakesAreMatchedOneToOneMaximallyAndInAnyOrder) {
    std::mt19937 random(5);
    const auto below = [&](unsigned n) { return static_cast<std::uint32_t>(random() % n); };
    for (int take = 0; take < 200; ++take) {
        std::vector<app::Strike> strikes;
        std::vector<app::TrueContact> contacts;
        for (std::uint64_t id = 1; id <= 40; ++id)
            strikes.push_back(note(id, below(1000) * 1e-3, below(2), below(2)));
        for (int i = 0; i < 40; ++i) contacts.push_back(contact(below(1000) * 1e-3, below(2), below(2)));
        std::sort(contacts.begin(), contacts.end(),
                  [](const auto& a, const auto& b) { return a.t_s < b.t_s; });
        const app::StrikeScore score = app::score_strikes(strikes, contacts);
        std::map<std::uint64_t, int> uses;
        for (const app::TrueContact& c : contacts) {
            if (c.matched_id != 0) {
                const app::Strike& strike = strikes[c.matched_id - 1];
                ++uses[c.matched_id];
                EXPECT_LE(std::abs(strike.onset_s - c.t_s), 0.030 + 1e-9);
                EXPECT_TRUE(strike.stick == c.stick && strike.instrument == c.instrument);
            }
        }
        for (const auto& [id, count] : uses) EXPECT_EQ(count, 1) << id;
        for (const app::TrueContact& c : contacts)
            for (const app::Strike& strike : strikes)
                EXPECT_FALSE(c.matched_id == 0 && uses.count(strike.id) == 0 && strike.stick == c.stick &&
                             strike.instrument == c.instrument &&
                             std::abs(strike.onset_s - c.t_s) < 0.030 - 1e-9);
        const int matched = static_cast<int>(uses.size());
        EXPECT_EQ(score.false_notes, 40 - matched);
        EXPECT_EQ(score.missed, 40 - matched);
        std::vector<app::TrueContact> again = contacts;
        std::shuffle(strikes.begin(), strikes.end(), random);
        EXPECT_EQ(app::score_strikes(strikes, again).timing_p95_ms, score.timing_p95_ms);
        for (std::size_t i = 0; i < contacts.size(); ++i)
            EXPECT_EQ(again[i].matched_id, contacts[i].matched_id);
    }
}

}  // namespace
