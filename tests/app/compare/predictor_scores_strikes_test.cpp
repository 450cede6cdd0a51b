// Strikes of predictors on paths whose contacts are known in closed form.
#include <gtest/gtest.h>
#include <tracking/sensor.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "compare/predictor_scores.h"
#include "sample_recordings.h"
#include "sticks/predictors.h"
#include "sticks/stick.h"
#include "written_kit.h"

namespace app {
namespace {

using Height = std::function<double(double)>;  // of the tip [m] at a time [s]

// Onsets are rounded up to the next audio sample, 1/48 ms; the times themselves are exact to rounding.
constexpr double kAudioSampleMs = 1e3 / 48000;
constexpr double kRoundingMs = 1e-3;

tracking::StickTrace stick_of(const Height& height, double last_s, double rate_hz = 250) {
    return sample::stick_of(
        [&](double t) {
            tracking::PoseSample pose;
            pose.position = {0, height(t), 0};
            return pose;
        },
        last_s, rate_hz);
}

StrikeSurface plane(double height_m) {
    StrikeSurface surface;
    surface.kind = StrikeSurface::Kind::plane;
    surface.height_m = height_m;
    return surface;
}

/// The stick's own samples through a predictor, with a tip at the tracked point.
HitScore score(const tracking::StickTrace& stick, const std::string& specification,
               const StrikeTiming& timing = {}, const StrikeSurface& surface = plane(0)) {
    const auto predictor = tracking::make_predictor(specification);
    return evaluate_strikes(tip_track(stick, {}), stick.samples, {*predictor, nullptr}, {}, surface, timing);
}

/// Falls at `speed` towards 0 at contact_s, turns back at turn_s.
Height fall(double speed, double contact_s, double turn_s = 1e9) {
    return [=](double t) {
        return t < turn_s ? speed * (contact_s - t) : speed * (contact_s - turn_s) + speed * (t - turn_s);
    };
}

void expect_on_time(const HitScore& hits, double late_ms, const std::string& what) {
    EXPECT_EQ(hits.true_contacts, 1) << what;
    EXPECT_EQ(hits.predicted, 1) << what;
    ASSERT_EQ(hits.errors_ms.size(), 1U) << what;
    EXPECT_GE(hits.errors_ms[0], late_ms - kRoundingMs) << what;
    EXPECT_LE(hits.errors_ms[0], late_ms + kAudioSampleMs + kRoundingMs) << what;
}

TEST(StrikeEvaluation, ATipThatFallsAtConstantSpeedIsTimedToAnAudioSampleAtEveryLead) {
    const tracking::StickTrace stick = stick_of(fall(2, 0.5), 0.6, 60);
    for (const double lead_s : {0.0, 0.010, 1.0 / 30, 1.0 / 15, 0.1, 0.15}) {
        for (const char* specification : {"difference", "cv", "ca", "singer:alpha=3,q=1e10"})
            expect_on_time(score(stick, specification, {lead_s}), 0, specification);
        EXPECT_EQ(score(stick, "hold", {lead_s}).predicted, 0) << "what stands still strikes nothing";
    }
}

TEST(StrikeEvaluation, AnAdvanceMakesContactsEarlierByJustThat) {
    const tracking::StickTrace stick = stick_of(fall(2, 0.5), 0.6, 60);
    for (const double advance_s : {-0.002, 0.003})
        expect_on_time(score(stick, "difference", {1.0 / 30, advance_s}), -1e3 * advance_s, "advance");
}

TEST(StrikeEvaluation, AFeintThatTurns20MsBeforeTheReleaseIsCancelledAndFalseOnlyWithoutCancelling) {
    const HitScore hits = score(stick_of(fall(2, 0.5, 0.47), 1), "difference");
    EXPECT_EQ(hits.true_contacts, 0);
    EXPECT_EQ(hits.predicted, 0);
    EXPECT_EQ(hits.false_without_cancel, 1);
    EXPECT_DOUBLE_EQ(hits.false_per_min_without_cancel(), 60);  // one in a second
    EXPECT_EQ(hits.false_per_min(), 0);
}

TEST(StrikeEvaluation, AFeintThatTurnsAfterTheReleaseIsFalseEitherWay) {
    const HitScore hits = score(stick_of(fall(2, 0.5, 0.496), 1), "difference");
    EXPECT_EQ(hits.true_contacts, 0);
    EXPECT_EQ(hits.predicted, 1);
    EXPECT_EQ(hits.false_notes(), 1);
    EXPECT_EQ(hits.false_without_cancel, 1);
}

TEST(StrikeEvaluation, LessThan3MmDeepIsNoTrueContact) {
    const auto deep = [](double depth_m) { return stick_of(fall(1, 0.5, 0.5 + depth_m), 1, 1000); };
    EXPECT_EQ(score(deep(0.002), "difference").true_contacts, 0);
    EXPECT_EQ(score(deep(0.004), "difference").true_contacts, 1);
}

TEST(StrikeEvaluation, AStrikeFoundLaterThanItsLeadSoundsLateByUpTo30Ms) {
    // Hangs 60 mm above, falls at 2 m/s from 0.500 s on: seen at 0.504 s, contact at 0.530 s.
    const tracking::StickTrace stick =
        stick_of([](double t) { return t < 0.5 ? 0.06 : 0.06 - 2 * (t - 0.5); }, 0.6);
    expect_on_time(score(stick, "difference", {0.050}), 24, "0.504 + 0.050 s");
    const HitScore too_late = score(stick, "difference", {0.060});  // would be 34 ms
    EXPECT_EQ(too_late.true_contacts, 1);
    EXPECT_EQ(too_late.predicted, 0);
    EXPECT_EQ(too_late.recall(), 0);
}

TEST(StrikeEvaluation, NoStrikeIsScoredWithoutASurface) {
    const HitScore hits = score(stick_of(fall(2, 0.5), 0.6), "difference", {}, {});
    EXPECT_EQ(hits.true_contacts + hits.predicted, 0);
    EXPECT_DOUBLE_EQ(hits.minutes, 0.01);
}

/// Falls and rises at 2 m/s between 200 mm and the lows given, a second each.
Height bounces(const std::vector<double>& lows_m) {
    return [=](double t) {
        const auto stroke = std::min(lows_m.size() - 1, static_cast<std::size_t>(t));
        return std::min(0.2, lows_m[stroke] + 2 * std::abs(t - static_cast<double>(stroke) - 0.5));
    };
}

TEST(StrikeEvaluation, TheContactHeightIsTheMedianOfTheLowsWithin50MmOfTheLowest) {
    const tracking::StickTrace stick = stick_of(bounces({0.000, 0.012, 0.100, 0.004}), 4);
    StrikeSurface above;
    above.kind = StrikeSurface::Kind::above_contact;
    above.height_m = 0.025;
    const HitScore by_lows = score(stick, "difference", {}, above),
                   by_height = score(stick, "difference", {}, plane(0.004 + 0.025));
    EXPECT_EQ(by_height.true_contacts, 3);
    EXPECT_EQ(by_lows.true_contacts, 3);
    EXPECT_EQ(by_lows.errors_ms, by_height.errors_ms);
    const tracking::StickTrace still = stick_of([](double) { return 0.1; }, 1);
    EXPECT_EQ(score(still, "difference", {}, above).true_contacts, 0) << "a stick without lows";
}

TEST(StrikeEvaluation, WhatIsDecidedDoesNotDependOnLaterSamples) {
    const tracking::StickTrace stick = stick_of(bounces({0, 0.01, 0.08, 0.002, 0.03}), 5);
    const auto run = [&](const std::string& specification, double until_s) {
        std::vector<tracking::PoseSample> samples;
        for (const tracking::PoseSample& sample : stick.samples)
            if (sample.t_s <= until_s) samples.push_back(sample);
        const auto predictor = tracking::make_predictor(specification);
        return evaluate_strikes(tip_track(stick, {}), samples, {*predictor, nullptr}, {}, plane(0.04), {});
    };
    for (const char* specification : {"cv", "bank"}) {
        const HitScore whole = run(specification, 1e9);
        ASSERT_EQ(whole.matched, 4) << specification;
        for (int seconds = 1; seconds < 5; ++seconds) {  // at rest on top: nothing is pending
            const HitScore cut = run(specification, seconds);
            ASSERT_LE(cut.errors_ms.size(), whole.errors_ms.size());
            EXPECT_TRUE(std::equal(cut.errors_ms.begin(), cut.errors_ms.end(), whole.errors_ms.begin()))
                << specification << " until " << seconds << " s";
            EXPECT_EQ(cut.matched, seconds < 3 ? seconds : seconds - 1) << specification;
        }
    }
}

/// Two models that know the motion of a tip that falls at 2 m/s; the second believes it 24 mm higher, so that
/// its contact comes 12 ms later. `first_until_s`: the first is selected before, the second from then on.
class TwoModels final : public tracking::Predictor {
public:
    TwoModels(Height height, double first_until_s, std::size_t before = 0)
        : height_(std::move(height)), first_until_s_(first_until_s), before_(before) {}

    [[nodiscard]] tracking::SampleStatus correct(const tracking::PoseSample& sample) noexcept override {
        const bool fresh = !time_s_;
        time_s_ = sample.t_s;
        return fresh ? tracking::SampleStatus::reinitialised : tracking::SampleStatus::accepted;
    }
    [[nodiscard]] double time_s() const noexcept override { return *time_s_; }
    [[nodiscard]] std::size_t models() const noexcept override { return 2; }
    [[nodiscard]] std::size_t selected() const noexcept override {
        return *time_s_ < first_until_s_ ? before_ : 1 - before_;
    }
    [[nodiscard]] tracking::PosePrediction predict(double lead_s) const noexcept override {
        return predict_model(selected(), lead_s);
    }
    [[nodiscard]] tracking::PosePrediction predict_model(std::size_t model,
                                                         double lead_s) const noexcept override {
        tracking::PosePrediction pose;
        const double t = *time_s_ + lead_s, h = 1e-6;
        pose.position = {0, height_(t) + (model == 1 ? 0.024 : 0), 0};
        pose.velocity = {0, (height_(t + h) - height_(t - h)) / (2 * h), 0};
        return pose;
    }

private:
    Height height_;
    double first_until_s_;
    std::size_t before_;
    std::optional<double> time_s_;
};

HitScore score_models(double first_until_s, std::size_t before = 0) {
    const Height height = fall(2, 0.5);
    const tracking::StickTrace stick = stick_of(height, 0.7);
    TwoModels models(height, first_until_s, before);
    return evaluate_strikes(tip_track(stick, {}), stick.samples, {models, nullptr}, {}, plane(0), {});
}

TEST(StrikeEvaluation, OfSeveralModelsThePendingContactOfTheSelectedOneIsPlayed) {
    expect_on_time(score_models(1), 0, "the first throughout");
    expect_on_time(score_models(0), 12, "the second throughout");
    // Both committed (66.7 ms ahead), then the other is selected: its pending contact is ready.
    expect_on_time(score_models(0.46), 12, "the second before the release");
    expect_on_time(score_models(0.46, 1), 0, "the first before the release");
}

TEST(StrikeEvaluation, AStrokeThatOneModelHasPlayedIsNotPlayedByAnother) {
    // The first releases at 0.490 s; the second, selected from 0.496 s on, would at 0.502 s.
    expect_on_time(score_models(0.496), 0, "one note");
}

TEST(StrikeEvaluation, AStrokeIsNotLostBetweenModels) {
    // The second is selected when the first releases, the first when the second does: both mean the stroke.
    expect_on_time(score_models(0.496, 1), 12, "one note");
}

TEST(StrikeEvaluation, AWideFlatDrumIsStruckAsAPlaneATipsRadiusAboveIt) {
    const tracking::StickTrace stick = stick_of(bounces({-0.02, -0.03, 0.05, -0.01, 0.03}), 5);
    StrikeSurface drum;
    drum.kind = StrikeSurface::Kind::kit;
    drum.kit = WrittenKit(kFlatDrum).read();
    for (const char* specification : {"difference", "ca"})
        for (const double lead_s : {0.010, 1.0 / 15}) {
            const HitScore on_drum = score(stick, specification, {lead_s}, drum),
                           on_plane = score(stick, specification, {lead_s}, plane(StickGeometry{}.radius_m));
            EXPECT_EQ(on_drum.true_contacts, 3);
            EXPECT_EQ(on_drum.true_contacts, on_plane.true_contacts);
            EXPECT_EQ(on_drum.predicted, on_plane.predicted);
            EXPECT_EQ(on_drum.false_without_cancel, on_plane.false_without_cancel);
            ASSERT_EQ(on_drum.errors_ms.size(), on_plane.errors_ms.size());
            // The head is an implicit surface that bulges by less than 0.1 mm: 0.05 ms at 2 m/s, in the onset
            // and in the truth, and an audio sample each.
            for (std::size_t i = 0; i < on_drum.errors_ms.size(); ++i)
                EXPECT_NEAR(on_drum.errors_ms[i], on_plane.errors_ms[i], 0.1 + kAudioSampleMs);
        }
}

TEST(StrikeEvaluation, AStrikeIsPlayedOnlyIfTheConfirmingFilterConfirmsIt) {
    const tracking::StickTrace stick = stick_of(fall(2, 0.5), 0.6);
    const auto with = [&](const char* confirming) {
        const auto timing = tracking::make_predictor("difference"),
                   other = tracking::make_predictor(confirming);
        return evaluate_strikes(tip_track(stick, {}), stick.samples, {*timing, other.get()}, {}, plane(0),
                                {});
    };
    expect_on_time(with("cv"), 0, "cv meets the plane too");
    const HitScore unconfirmed = with("hold");  // stands still, until it is inside
    EXPECT_EQ(unconfirmed.true_contacts, 1);
    EXPECT_EQ(unconfirmed.matched, 0);
    EXPECT_EQ(unconfirmed.false_without_cancel, 0) << "without cancelling all that was found is played";
}

TEST(HitScore, FiguresAreThoseOfTheirDefinitions) {
    HitScore hits;
    EXPECT_TRUE(std::isnan(hits.precision()));
    EXPECT_TRUE(std::isnan(hits.recall()));
    EXPECT_TRUE(std::isnan(hits.f1()));
    EXPECT_TRUE(std::isnan(hits.median_ms()));
    EXPECT_TRUE(std::isnan(hits.p95_ms()));
    EXPECT_EQ(hits.loss(), 0);
    hits.true_contacts = 5, hits.predicted = 4, hits.matched = 3;
    hits.false_without_cancel = 6, hits.minutes = 0.5;
    hits.errors_ms = {-9, 3, 6};
    EXPECT_DOUBLE_EQ(hits.precision(), 3.0 / 4);
    EXPECT_DOUBLE_EQ(hits.recall(), 3.0 / 5);
    EXPECT_DOUBLE_EQ(hits.f1(), 2 * 3.0 / 9);
    EXPECT_DOUBLE_EQ(hits.f1(), 2 / (1 / hits.precision() + 1 / hits.recall()));
    EXPECT_EQ(hits.median_ms(), 6);
    EXPECT_DOUBLE_EQ(hits.p95_ms(), 8.7);  // 6 + 0.9 (9 - 6)
    EXPECT_EQ(hits.false_per_min(), 2);
    EXPECT_EQ(hits.false_per_min_without_cancel(), 12);
    EXPECT_DOUBLE_EQ(hits.loss(), 2 + 1 + 0.5 * 18.0 / 30);  // missed, false, and the times
}

TEST(HitScore, SumsAreOfCountsAndTimes) {
    HitScore sum, other;
    sum.true_contacts = 2, sum.predicted = 2, sum.matched = 1, sum.minutes = 1, sum.errors_ms = {-4};
    other.true_contacts = 3, other.predicted = 4, other.matched = 3, other.minutes = 2;
    other.false_without_cancel = 5, other.errors_ms = {1, 2, 8};
    const double loss = sum.loss() + other.loss();
    sum.add(other);
    EXPECT_EQ(sum.true_contacts, 5);
    EXPECT_EQ(sum.false_notes(), 2);
    EXPECT_EQ(sum.matched, 4);
    EXPECT_EQ(sum.median_ms(), 3);
    EXPECT_DOUBLE_EQ(sum.false_per_min(), 2.0 / 3);
    EXPECT_DOUBLE_EQ(sum.false_per_min_without_cancel(), 5.0 / 3);
    EXPECT_DOUBLE_EQ(sum.loss(), loss);
}

}  // namespace
}  // namespace app
