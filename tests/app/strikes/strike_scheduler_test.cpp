// Strikes of a tip that moves over one plane y = 0: contacts are computed here from a local parabola, as a
// filter without noise would predict them.
#include "strikes/strike_scheduler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <set>
#include <span>

namespace app {
namespace {

constexpr double kLeadS = 1.0 / 15;
constexpr double kMarginS = 0.010;

using Height = std::function<double(double)>;  // of the tip over the surface [m] at a time [s]

struct Motion {
    double y, v, a;
};

/// The parabola through three points of the past, as a filter that lags by nothing would see it.
Motion motion_at(const Height& height, double t) {
    const double h = 1e-4;
    const double y0 = height(t), y1 = height(t - h), y2 = height(t - 2 * h);
    return {y0, (3 * y0 - 4 * y1 + y2) / (2 * h), (y0 - 2 * y1 + y2) / (h * h)};
}

/// Inward crossings of y = 0 on the parabola over [t, t + lead], the second only after 3 mm outside; as the
/// simulation reports them.
std::vector<sim::Contact> contacts_of(const Motion& m, double t) {
    std::vector<sim::Contact> found;
    const auto y = [&](double h) { return m.y + m.v * h + 0.5 * m.a * h * h; };
    bool armed = true;
    double before = m.y;
    const auto add = [&](double h, bool inside) {
        sim::Contact contact;
        contact.t_s = t + h;
        contact.starts_inside = inside;
        contact.speed_mps = -(m.v + m.a * h);
        contact.zone = 0;
        contact.impulse_body = Eigen::Vector3d(0, contact.speed_mps, 0);
        found.push_back(contact);
        armed = false;
    };
    if (m.y <= 0) add(0, true);
    constexpr int n = 2000;
    for (int i = 1; i <= n; ++i) {
        const double h = kLeadS * i / n;
        if (armed && before > 0 && y(h) <= 0) add(h, false);
        if (y(h) >= 0.003) armed = true;
        before = y(h);
    }
    return found;
}

/// A sample of stick 0 over instrument 0, of a predictor with one model.
void take_sample(StrikeScheduler& scheduler, double s, std::span<const sim::Contact> contacts,
                 double clearance, std::span<const double> silent_until_s = {}) {
    const ModelContacts model{contacts, std::span(&clearance, 1), silent_until_s};
    scheduler.sample(0, s, std::span(&model, 1), 0, {std::span(&clearance, 1)});
}

/// The same of a tip that may have passed right through the instrument at `passed_s`, on the way here.
void take_sample(StrikeScheduler& scheduler, double s, std::span<const sim::Contact> contacts,
                 double clearance, double passed_s) {
    sim::Contact passed;
    passed.t_s = passed_s;
    passed.speed_mps = 20;
    passed.zone = 0;
    const ModelContacts model{contacts, std::span(&clearance, 1)};
    scheduler.sample(0, s, std::span(&model, 1), 0, {std::span(&clearance, 1), {&passed, 1}});
}

struct Notes {
    std::vector<Strike> strikes;
    bool causal = true;  // no sample changed a note nearer than the release margin
    [[nodiscard]] std::vector<Strike> with(Outcome outcome) const {
        std::vector<Strike> result;
        for (const Strike& strike : strikes)
            if (strike.outcome == outcome) result.push_back(strike);
        return result;
    }
};

Notes play(const Height& height, double duration, double rate = 120, bool cancelling = true) {
    StrikeRules rules;
    rules.cancelling = cancelling;
    StrikeScheduler scheduler(rules, 1, 1);
    scheduler.restart(0);
    Notes run;
    for (int i = 0; i / rate < duration; ++i) {
        const double s = i / rate;
        const Motion m = motion_at(height, s);
        scheduler.advance_to(s);
        take_sample(scheduler, s, contacts_of(m, s), m.y);
        for (const std::uint64_t id : scheduler.take_changes())
            if (scheduler.strikes()[id - 1].onset_s < s + kMarginS - 1e-9) run.causal = false;
    }
    scheduler.finish();
    run.strikes = scheduler.strikes();
    return run;
}

/// Strokes at `rate_hz`: falls from `top` and bounces, touching y = -depth at each 1/rate.
Height strokes(double rate_hz, double top, double depth) {
    return [=](double t) {
        const double phase = std::abs(std::sin(std::numbers::pi * rate_hz * t));
        return (top + depth) * phase - depth;
    };
}

TEST(StrikeScheduler, APathThatTurnsBackIntoABodyFromTheSideIsNoSecondStroke) {
    for (const double degrees : {0.0, 40.0, 80.0, 180.0}) {
        StrikeScheduler scheduler({}, 1, 1);
        scheduler.restart(0);
        std::vector<sim::Contact> contacts(2);
        for (sim::Contact& contact : contacts) contact.zone = 0, contact.speed_mps = 5;
        contacts[0].t_s = 0.140, contacts[1].t_s = 0.150;
        const double angle = degrees * std::numbers::pi / 180;
        contacts[1].normal_world = {std::sin(angle), std::cos(angle), 0};
        for (const double s : {0.08, 0.09, 0.10, 0.11}) {
            scheduler.advance_to(s);
            take_sample(scheduler, s, contacts, 0.1);
        }
        EXPECT_EQ(scheduler.strikes().size(), degrees < 60 ? 2U : 1U) << degrees;
    }
}

/// A tip that falls at 20 m/s right through a disc at 0.1 s, seen at `rate`, and expected to meet it or not.
Notes pass_through(double rate, bool expected) {
    StrikeScheduler scheduler({}, 1, 1);
    scheduler.restart(0);
    Notes run;
    double before_s = -1;
    for (int i = 0; i < static_cast<int>(0.3 * rate); ++i) {
        const double s = i / rate,
                     clearance = s < 0.1 ? 20 * (0.1 - s) : std::max(1e-3, 20 * (s - 0.1) - 0.03);
        std::vector<sim::Contact> contacts;
        if (expected && s < 0.1 && s > 0.04) contacts = contacts_of({20 * (0.1 - s), -20, 0}, s);
        scheduler.advance_to(s);
        if (before_s < 0.1 && s >= 0.1)
            take_sample(scheduler, s, contacts, clearance, 0.1);
        else
            take_sample(scheduler, s, contacts, clearance);
        for (const std::uint64_t id : scheduler.take_changes())
            if (scheduler.strikes()[id - 1].onset_s < s + kMarginS - 1e-9) run.causal = false;
        before_s = s;
    }
    scheduler.finish();
    run.strikes = scheduler.strikes();
    return run;
}

TEST(StrikeScheduler, AStrokeRightThroughAThinBodySoundsOnceWhetherExpectedOrNot) {
    for (const double rate : {57.0, 87.0, 240.0})
        for (const bool expected : {true, false}) {
            const Notes run = pass_through(rate, expected);
            EXPECT_TRUE(run.causal);
            ASSERT_EQ(run.strikes.size(), 1U) << rate << expected;
            EXPECT_EQ(run.strikes[0].outcome, Outcome::released);
            // One that nobody expected sounds a release margin after the sample that shows it, which comes within a period.
            const double late_s = expected ? 0 : kMarginS + 1 / rate;
            EXPECT_GE(run.strikes[0].onset_s, 0.1 - 1e-9);
            EXPECT_LE(run.strikes[0].onset_s, 0.1 + late_s + kLeadS / 2000 + 1.0 / 48000)
                << rate << expected << ": but for a step of contacts_of() and a sample of audio";
        }
    // At 41 Hz it is seen 22 ms later, and would sound 32 ms late.
    EXPECT_TRUE(pass_through(41, false).strikes.empty());
}

TEST(StrikeScheduler, OneStrokeThatBouncesMakesOneReleasedNoteAtItsContact) {
    const Height height = [](double t) { return 2.0 * std::abs(t - 0.5) - 0.004; };  // 2 m/s, 4 mm deep
    const Notes run = play(height, 1);
    ASSERT_EQ(run.with(Outcome::released).size(), 1U);
    // Motion is uniform until contact, so the prediction is exact to one audio sample and one step of the
    // search above.
    EXPECT_NEAR(run.strikes[0].onset_s, 0.498, 1.0 / 48000 + kLeadS / 2000);
    EXPECT_NEAR(run.strikes[0].speed_mps, 2.0, 1e-6);
    EXPECT_TRUE(run.causal);
}

TEST(StrikeScheduler, OnsetsLieExactlyOnAudioSamples) {
    const Notes run = play(strokes(3, 0.1, 0.004), 2);
    ASSERT_FALSE(run.strikes.empty());
    for (const Strike& strike : run.strikes)
        EXPECT_EQ(strike.onset_s, static_cast<double>(strike.onset_sample) / 48000);
}

TEST(StrikeScheduler, AFeintThatTurns40MsBeforeItsContactIsCancelledAndWithoutCancellingIsPlayed) {
    // Falls at 2 m/s, turns back 80 mm above: a contact 40 ms later had been predicted.
    const Height height = [](double t) { return 0.08 + 2.0 * std::abs(t - 0.5); };
    const Notes run = play(height, 1);
    EXPECT_EQ(run.with(Outcome::released).size(), 0U);
    EXPECT_EQ(run.with(Outcome::cancelled).size(), 1U);
    EXPECT_EQ(play(height, 1, 120, false).with(Outcome::released).size(), 1U);
}

TEST(StrikeScheduler, RollsOf7And15HzMakeOneNoteAStroke) {
    for (const double rate : {7.0, 15.0}) {
        const Notes run = play(strokes(rate, 0.04, 0.004), 2.02);
        // Strokes at k / rate; the first at t = 0 begins inside and makes none.
        const std::vector<Strike> released = run.with(Outcome::released);
        const auto sounded =
            std::count_if(released.begin(), released.end(), [](const Strike& s) { return s.onset_s < 2.02; });
        EXPECT_EQ(sounded, static_cast<long>(2.0 * rate)) << rate << " Hz";
        EXPECT_TRUE(run.causal);
    }
}

TEST(StrikeScheduler, AStickThatRestsOnTheHeadOrSinksInStrikesOnce) {
    const Height sinks = [](double t) { return t < 0.5 ? 1.0 * (0.5 - t) : -0.01 * (t - 0.5); };
    EXPECT_EQ(play(sinks, 2).with(Outcome::released).size(), 1U);
    const Height trembles = [](double t) { return t < 0.5 ? 1.0 * (0.5 - t) : 0.002 * std::sin(60 * t); };
    EXPECT_EQ(play(trembles, 2).with(Outcome::released).size(), 1U);
}

TEST(StrikeScheduler, ContactsSlowerThan0_2MpsMakeNoNote) {
    const Height slow = [](double t) { return 0.15 * (0.5 - t); };
    EXPECT_TRUE(play(slow, 1).strikes.empty());
}

TEST(StrikeScheduler, ATipThatIsInsideAtTheFirstSampleDoesNotStrikeUntilItHasRisen) {
    const Height height = [](double t) {
        if (t < 0.3) return -0.02;
        if (t < 0.6) return -0.02 + 0.5 * (t - 0.3);
        return 0.13 - 1.0 * (t - 0.6);
    };
    const Notes run = play(height, 1);
    ASSERT_EQ(run.with(Outcome::released).size(), 1U);
    EXPECT_NEAR(run.with(Outcome::released)[0].onset_s, 0.73, 0.001);
}

TEST(StrikeScheduler, TheFirstThreeSamplesMakeNoStrike) {
    // Contact at 20 ms: predicted by the samples at 0, 8.3 and 16.7 ms, which may not strike; the next is 5
    // ms late.
    const Height height = [](double t) { return 2.0 * (0.020 - t); };
    const Notes run = play(height, 0.3);
    for (const Strike& strike : run.strikes) EXPECT_GE(strike.scheduled_at_s, 3.0 / 120 - 1e-12);
}

TEST(StrikeScheduler, AStrokeFoundLateSoundsOneMarginAfterTheSampleThatFoundIt) {
    // One sudden fall between two samples: no prediction before it.
    const double s = 60 / 120.0;
    const Height height = [=](double t) { return t < s - 0.004 ? 0.02 : 0.02 - 6.0 * (t - s + 0.004); };
    const Notes run = play(height, 0.6);
    ASSERT_EQ(run.with(Outcome::released).size(), 1U);
    const Strike strike = run.with(Outcome::released)[0];
    EXPECT_NEAR(strike.onset_s, s + kMarginS, 1.0 / 48000 + 1e-9);
}

TEST(StrikeScheduler, AContactFoundMoreThan30MsLateIsNotPlayed) {
    // 20 samples a second: the tip falls in right after a sample and is found 50 ms later.
    const Height height = [](double t) { return t < 1.001 ? 0.02 : 0.02 - 2.0 * (t - 1.001); };
    EXPECT_EQ(play(height, 1.3, 20).with(Outcome::released).size(), 0U);
}

TEST(StrikeScheduler, AContactPredictedAgainWithin30MsOfItsCancelledOnsetKeepsItsId) {
    StrikeScheduler scheduler({}, 1, 1);
    const double clearance = 0.05;
    sim::Contact contact;
    contact.zone = 0;
    contact.speed_mps = 2;
    for (int i = 0; i < 4; ++i) take_sample(scheduler, 0.01 * i, {}, clearance);
    contact.t_s = 0.100;
    take_sample(scheduler, 0.04, std::span(&contact, 1), clearance);
    take_sample(scheduler, 0.05, {}, clearance);
    ASSERT_EQ(scheduler.strikes()[0].outcome, Outcome::cancelled);
    contact.t_s = 0.115;
    take_sample(scheduler, 0.06, std::span(&contact, 1), clearance);
    ASSERT_EQ(scheduler.strikes().size(), 1U);
    EXPECT_EQ(scheduler.strikes()[0].outcome, Outcome::pending);
    take_sample(scheduler, 0.07, {}, clearance);
    contact.t_s = 0.160;
    take_sample(scheduler, 0.10, std::span(&contact, 1), clearance);
    EXPECT_EQ(scheduler.strikes().size(), 2U) << "45 ms away is another contact";
}

TEST(StrikeScheduler, SilentZonesMakeNoNote) {
    StrikeScheduler scheduler({}, 1, 1);
    sim::Contact contact;
    contact.zone = -1;
    contact.speed_mps = 2;
    contact.t_s = 0.08;
    for (int i = 0; i < 6; ++i) take_sample(scheduler, 0.01 * i, std::span(&contact, 1), 0.05);
    EXPECT_TRUE(scheduler.strikes().empty());
}

/// A scheduler whose notes' times are fixed 50 ms ahead, told one predicted contact at each sample while the
/// tip hangs 50 mm above. It is settled at 0.035 s.
class Committed {
public:
    explicit Committed(bool cancelling = true) : scheduler_(rules(cancelling), 1, 1) {
        for (int i = 0; i < 4; ++i) sample(0.01 * i, std::nullopt);
    }
    void sample(double s, std::optional<double> contact_s, double clearance = 0.05,
                std::optional<double> silent_until_s = {}) {
        sim::Contact contact;
        contact.zone = 0;
        contact.speed_mps = 2;
        contact.t_s = contact_s.value_or(0);
        scheduler_.advance_to(s);
        take_sample(scheduler_, s, std::span(&contact, contact_s ? 1 : 0), clearance,
                    silent_until_s ? std::span(&*silent_until_s, 1) : std::span<const double>());
    }
    [[nodiscard]] const std::vector<Strike>& strikes() const { return scheduler_.strikes(); }
    [[nodiscard]] const Strike& first() const { return scheduler_.strikes().at(0); }

    static constexpr double kSample_s = 1.0 / 48000 + 1e-9;  // onsets are rounded up to audio samples

private:
    static StrikeRules rules(bool cancelling) {
        StrikeRules rules;
        rules.release_margin_s = 0.010;
        rules.commit_lead_s = rules.sent_lead_s = 0.050;
        rules.cancelling = cancelling;
        return rules;
    }
    StrikeScheduler scheduler_;
};

TEST(CommitLead, ANoteIsTimedUntilThenAndItsTimeStandsFromThenOn) {
    Committed run;
    run.sample(0.040, 0.100);
    EXPECT_NEAR(run.first().onset_s, 0.100, Committed::kSample_s);
    run.sample(0.049, 0.103);
    EXPECT_NEAR(run.first().onset_s, 0.103, Committed::kSample_s);
    for (const double s : {0.056, 0.070, 0.090}) run.sample(s, 0.115);
    EXPECT_NEAR(run.first().onset_s, 0.103, Committed::kSample_s);
    run.sample(0.094, 0.115);
    EXPECT_EQ(run.first().outcome, Outcome::released);
    EXPECT_NEAR(run.first().decided_at_s, 0.093, Committed::kSample_s) << "a release margin ahead";
    EXPECT_EQ(run.strikes().size(), 1U);
}

TEST(CommitLead, AContactFoundLaterThanThatIsDelayedToIt) {
    Committed run;
    run.sample(0.040, 0.070);
    EXPECT_NEAR(run.first().onset_s, 0.090, Committed::kSample_s);
    Committed late;
    late.sample(0.040, 0.059);  // would sound 31 ms late
    EXPECT_TRUE(late.strikes().empty());
}

TEST(CommitLead, ACommittedNoteMayBeCancelledAndIsTakenUpAgainAtTheTimeThatStood) {
    Committed run;
    run.sample(0.040, 0.100);
    run.sample(0.060, std::nullopt);
    EXPECT_EQ(run.first().outcome, Outcome::cancelled);
    run.sample(0.080, 0.110);
    EXPECT_EQ(run.first().outcome, Outcome::pending);
    EXPECT_NEAR(run.first().onset_s, 0.100, Committed::kSample_s);
    EXPECT_EQ(run.strikes().size(), 1U);
}

TEST(CommitLead, ATimeThatCanNoLongerBeMetIsNotTakenUp) {
    Committed run;
    run.sample(0.040, 0.100);
    run.sample(0.060, std::nullopt);
    run.sample(0.092, 0.118);  // 0.100 is nearer than the release margin; 0.142 is 24 ms late
    EXPECT_EQ(run.strikes().size(), 1U) << "the contact keeps its id";
    EXPECT_EQ(run.first().outcome, Outcome::pending);
    EXPECT_NEAR(run.first().onset_s, 0.142, Committed::kSample_s);
}

TEST(CommitLead, ATimeThatStoodIsTakenUpAlsoByAContactTooSoonForANewNote) {
    Committed run;
    run.sample(0.040, 0.100);
    run.sample(0.060, std::nullopt);
    run.sample(0.070, 0.085);  // a new note would come at 0.120, 35 ms late
    EXPECT_EQ(run.first().outcome, Outcome::pending);
    EXPECT_NEAR(run.first().onset_s, 0.100, Committed::kSample_s);
}

TEST(CommitLead, WhatIsNotWorthASoundIsCancelledAtTheLastSampleBeforeItsRelease) {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    Committed run;
    run.sample(0.060, 0.112, 0.05, kNever);  // another sample will come by 0.090: there is time to wait
    EXPECT_EQ(run.first().outcome, Outcome::pending);
    run.sample(0.085, 0.112, 0.05, kNever);  // the next one may come by 0.110, after the release at 0.102
    EXPECT_EQ(run.first().outcome, Outcome::cancelled);
    run.sample(0.095, 0.112, 0.05,
               0.111);  // it came sooner, and says that what sounds from 0.111 on is worth it
    EXPECT_EQ(run.first().outcome, Outcome::pending);
    EXPECT_NEAR(run.first().onset_s, 0.112, Committed::kSample_s);
    run.sample(0.103, 0.112);
    EXPECT_EQ(run.first().outcome, Outcome::released);
}

TEST(CommitLead, ACommittedNoteIsNotBorneOutByAContactMoreThan30MsLater) {
    Committed near;
    near.sample(0.040, 0.100);
    near.sample(0.060, 0.129);
    EXPECT_EQ(near.first().outcome, Outcome::pending);
    Committed far;
    far.sample(0.040, 0.100);
    far.sample(0.060, 0.131);
    EXPECT_EQ(far.first().outcome, Outcome::cancelled);
    ASSERT_EQ(far.strikes().size(), 2U) << "the later contact is one of its own";
    EXPECT_NEAR(far.strikes()[1].onset_s, 0.131, Committed::kSample_s);
}

TEST(CommitLead, ACommittedNoteMoreThan30MsBehindTheTipThatHasEnteredIsCancelled) {
    const auto entering = [](double entered_s, bool cancelling) {
        Committed run(cancelling);
        run.sample(0.080, 0.160);
        run.sample(0.112, 0.160);
        run.sample(entered_s, std::nullopt, -0.001);  // from 50 mm above: straight, so 0.98 of the way
        return run.first().outcome;
    };
    EXPECT_EQ(entering(0.120, true), Outcome::cancelled);
    EXPECT_EQ(entering(0.140, true), Outcome::pending);
    EXPECT_EQ(entering(0.120, false), Outcome::pending);
}

TEST(CommitLead, WithoutCancellingOnlyNotesNotYetSentAreDropped) {
    Committed sent(false);
    sent.sample(0.040, 0.100);
    sent.sample(0.049, 0.098);
    sent.sample(0.060, std::nullopt);
    sent.sample(0.095, std::nullopt);
    EXPECT_EQ(sent.first().outcome, Outcome::released);
    Committed unsent(false);
    unsent.sample(0.040, 0.100);
    unsent.sample(0.045, std::nullopt);
    unsent.sample(0.095, std::nullopt);
    EXPECT_EQ(unsent.first().outcome, Outcome::cancelled);
}

/// One stick over one instrument; contacts are given at will.
struct Late {
    StrikeRules rules;
    StrikeScheduler scheduler{rules, 1, 1};

    Late() {
        for (int i = 0; i < 4; ++i) sample(0.01 * i, std::nullopt);
    }
    void sample(double s, std::optional<double> contact_s,
                double fixed_s = -std::numeric_limits<double>::infinity()) {
        scheduler.advance_to(s, fixed_s);
        std::vector<sim::Contact> contacts;
        if (contact_s) {
            contacts.emplace_back();
            contacts[0].t_s = *contact_s;
            contacts[0].zone = 0;
            contacts[0].speed_mps = 3;
        }
        take_sample(scheduler, s, contacts, 0.1);
    }
    [[nodiscard]] const Strike& first() const { return scheduler.strikes().at(0); }
};

TEST(LateSample, WhatSoundsAlreadyIsReleasedAndCannotBeCancelled) {
    Late in_time, late;
    for (Late* run : {&in_time, &late}) run->sample(0.040, 0.080);
    in_time.sample(0.060, std::nullopt, 0.075);
    late.sample(0.060, std::nullopt, 0.0801);  // by the time it is here the sound is beyond the onset
    EXPECT_EQ(in_time.first().outcome, Outcome::cancelled);
    EXPECT_EQ(late.first().outcome, Outcome::released);
    EXPECT_NEAR(late.first().onset_s, 0.080, 1.0 / 48000);
}

TEST(LateSample, ANewNoteIsPlacedWhereTheSoundIsNotFixedYet) {
    Late run;
    run.sample(0.040, 0.052, 0.061);
    ASSERT_EQ(run.scheduler.strikes().size(), 1U);
    EXPECT_GE(run.first().onset_s, 0.061);
    EXPECT_LT(run.first().onset_s, 0.061 + 1.0 / 48000);
    Late too_late;  // 30 ms behind its contact a note is not played
    too_late.sample(0.040, 0.052, 0.0825);
    EXPECT_TRUE(too_late.scheduler.strikes().empty());
}

TEST(LateSample, AFixedTimeBehindTheMarginChangesNothing) {
    Late plain, fixed;
    for (int i = 4; i < 9; ++i) {
        plain.sample(0.01 * i, 0.12);
        fixed.sample(0.01 * i, 0.12, 0.01 * i + 0.0099);
    }
    EXPECT_EQ(plain.first().onset_sample, fixed.first().onset_sample);
    EXPECT_EQ(plain.first().moves, fixed.first().moves);
}

/// Two models over one instrument, each told one contact or none at each sample. Settled at 0.035 s.
class TwoModels {
public:
    TwoModels() {
        for (int i = 0; i < 4; ++i) sample(0.01 * i, 0, std::nullopt, std::nullopt);
    }
    void sample(double s, std::size_t selected, std::optional<double> first_s, std::optional<double> second_s,
                double clearance = 0.05) {
        std::vector<sim::Contact> contacts[2];
        const std::span<const double> distance(&clearance, 1);
        std::vector<ModelContacts> expected;
        for (const std::optional<double>& contact_s : {first_s, second_s}) {
            std::vector<sim::Contact>& own = contacts[expected.size()];
            if (contact_s) {
                own.emplace_back();
                own[0].t_s = *contact_s;
                own[0].zone = 0;
                own[0].speed_mps = 2;
            }
            expected.push_back({own, distance});
        }
        scheduler_.advance_to(s);
        scheduler_.sample(0, s, expected, selected, {distance});
        for (const std::uint64_t id : scheduler_.take_changes())
            if (strikes()[id - 1].outcome != Outcome::cancelled)
                sounding_.insert(id);
            else
                sounding_.erase(id);
    }
    [[nodiscard]] const std::vector<Strike>& strikes() const { return scheduler_.strikes(); }
    [[nodiscard]] const Strike& first() const { return strikes().at(0); }
    /// Ids of the notes that the audio has.
    [[nodiscard]] const std::set<std::uint64_t>& sounding() const { return sounding_; }

private:
    StrikeScheduler scheduler_{{}, 1, 1};
    std::set<std::uint64_t> sounding_;
};

constexpr double kAudioSampleS = 1.0 / 48000 + 1e-9;

TEST(SeveralModels, OnlyTheSelectedModelsContactsAreStrikes) {
    TwoModels run;
    run.sample(0.040, 1, 0.100, std::nullopt);
    EXPECT_TRUE(run.strikes().empty());
    run.sample(0.050, 1, 0.100, 0.110);
    ASSERT_EQ(run.strikes().size(), 1U);
    EXPECT_NEAR(run.first().onset_s, 0.110, kAudioSampleS);
    EXPECT_EQ(run.first().model, 1U);
    EXPECT_EQ(run.first().scheduled_at_s, 0.050);
}

TEST(SeveralModels, AStrikeGoesOnWithTheContactThatANewlySelectedModelHasReady) {
    TwoModels run;
    run.sample(0.040, 0, 0.100, 0.112);
    run.sample(0.050, 0, 0.100, 0.112);
    EXPECT_EQ(run.first().moves, 0);
    run.sample(0.060, 1, 0.100, 0.112);
    ASSERT_EQ(run.strikes().size(), 1U) << "the same stroke";
    EXPECT_NEAR(run.first().onset_s, 0.112, kAudioSampleS);
    EXPECT_EQ(run.first().model, 1U);
    EXPECT_EQ(run.first().moves, 1);
    EXPECT_EQ(run.first().scheduled_at_s, 0.040);
    run.sample(0.070, 0, 0.101, 0.112);
    EXPECT_NEAR(run.first().onset_s, 0.101, kAudioSampleS);
    EXPECT_EQ(run.first().moves, 2);
    run.sample(0.095, 0, 0.101, 0.112);
    EXPECT_EQ(run.first().outcome, Outcome::released);
    EXPECT_EQ(run.sounding(), std::set<std::uint64_t>{1});
}

TEST(SeveralModels, AStrikeThatTheNewlySelectedModelDoesNotExpectIsCancelledAndComesBackWithItsOwnModel) {
    TwoModels run;
    run.sample(0.040, 0, 0.100, std::nullopt);
    run.sample(0.050, 1, 0.100, std::nullopt);
    EXPECT_EQ(run.first().outcome, Outcome::cancelled);
    EXPECT_EQ(run.first().decided_at_s, 0.050);
    EXPECT_TRUE(run.sounding().empty());
    run.sample(0.060, 0, 0.100, std::nullopt);
    ASSERT_EQ(run.strikes().size(), 1U);
    EXPECT_EQ(run.first().outcome, Outcome::pending);
    EXPECT_EQ(run.sounding(), std::set<std::uint64_t>{1});
}

TEST(SeveralModels, AStrokeThatOneModelHasPlayedIsNotPlayedByAnotherUntilTheTipHasRisen) {
    TwoModels run;
    run.sample(0.040, 0, 0.100, 0.118);
    run.sample(0.095, 1, std::nullopt, 0.118,
               0.010);  // the first's note is released, then the second selected
    run.sample(0.105, 1, std::nullopt, 0.118, -0.003);
    run.sample(0.115, 1, std::nullopt, std::nullopt, -0.002);
    ASSERT_EQ(run.strikes().size(), 1U);
    EXPECT_EQ(run.first().outcome, Outcome::released);
    for (const double s : {0.125, 0.135, 0.145}) run.sample(s, 1, std::nullopt, std::nullopt, 0.020);
    run.sample(0.155, 1, std::nullopt, 0.200, 0.020);
    EXPECT_EQ(run.strikes().size(), 2U) << "another stroke";
}

TEST(SeveralModels, AModelThatReleasedItsContactUnselectedStandsByTheStroke) {
    TwoModels run;
    run.sample(0.040, 1, 0.100, 0.118);
    run.sample(0.095, 0, 0.100, 0.118);  // the first's has just been released, unheard
    EXPECT_EQ(run.first().outcome, Outcome::pending);
    EXPECT_EQ(run.sounding(), std::set<std::uint64_t>{1});
    run.sample(0.110, 0, std::nullopt, 0.118, -0.001);
    EXPECT_EQ(run.first().outcome, Outcome::released);
    EXPECT_NEAR(run.first().onset_s, 0.118, kAudioSampleS);
}

}  // namespace
}  // namespace app
