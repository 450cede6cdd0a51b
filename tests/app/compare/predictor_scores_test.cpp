#include "compare/predictor_scores.h"

#include <gtest/gtest.h>

#include <array>
#include <random>

#include "sample_recordings.h"

namespace {

constexpr double kPi = std::numbers::pi;

std::vector<app::LeadScore> scores_of(const app::Recording& recording, const std::string& predictor,
                                      const std::vector<double>& leads_s,
                                      const tracking::SensorModel& sensor = {}) {
    const app::SensedStick stick = app::sense_stick(recording, 0, sensor, leads_s);
    return app::score_predictor(stick, *tracking::make_predictor(predictor));
}

TEST(PredictionError, HoldOnASineErrsBySqrt2TimesAmplitudeTimesSinOfHalfTheLeadsPhase) {
    // Scored are the samples of [0.5, 10.499], whole periods, with truth up to 10.599.
    const auto scores = scores_of(sample::recording_of(sample::sine, 10.599), "hold", {0.1});
    EXPECT_EQ(scores[0].error.position.count, 10000U);
    // The lead is a whole number of samples, so that interpolation is exact: rounding only.
    EXPECT_NEAR(scores[0].error.position.rms(), std::sqrt(2.0) * 100 * std::sin(kPi * 0.1), 1e-9);
    // The error is 200 sin(0.1 pi) |cos(...)| with evenly spread phase: 95 % lie below cos(0.025 pi) of it.
    // Neighbouring errors there differ by less than 0.03 mm.
    EXPECT_NEAR(scores[0].error.p95_mm(), 200 * std::sin(kPi * 0.1) * std::cos(0.025 * kPi), 0.03);
}

TEST(PredictionError, ConstantVelocityAndTurningArePredictedByDifferenceWithoutError) {
    for (const double rate_hz : {0.0, 60.0, 37.0}) {
        tracking::SensorModel sensor;
        sensor.rate_hz = rate_hz;
        app::Recording recording = sample::recording_of(sample::steady, 5, 250);
        recording.geometry.tip = {0, 0, -0.4};
        for (const app::LeadScore& score :
             scores_of(recording, "difference", {1.0 / 30, 1.0 / 15, 0.1}, sensor)) {
            EXPECT_GT(score.error.position.count, 150U);
            EXPECT_LT(score.error.position.rms(),
                      1e-8);  // rounding of 10 m over steps of 4 ms, times a lead of 0.1 s
            EXPECT_LT(score.error.rotation.rms(), 1e-8);
            EXPECT_LT(score.error.tip.rms(), 1e-8);
        }
    }
}

TEST(PredictionError, HoldOnASteadyTurnErrsByRateTimesLeadAndItsTipByTheChord) {
    app::Recording recording = sample::recording_of(sample::steady, 5, 250);
    for (tracking::PoseSample& sample : recording.trace.sticks[0].samples) sample.position = {0, 1, 0};
    recording.geometry.tip = {0.4, 0, 0};
    const auto scores = scores_of(recording, "hold", {0.1});
    EXPECT_NEAR(scores[0].error.position.rms(), 0, 1e-12);
    EXPECT_NEAR(scores[0].error.rotation.rms(), 0.3 * 180 / kPi, 1e-9);
    EXPECT_NEAR(scores[0].error.tip.rms(), 2 * 400 * std::sin(0.15), 1e-9);
}

TEST(PredictionError, NoiseOfASensorIsTheErrorOfHoldOnAStickAtRest) {
    tracking::SensorModel sensor;
    sensor.noise_m = 0.001;
    const auto still = [](double) {
        tracking::PoseSample pose;
        pose.position = {0, 1, 0};
        return pose;
    };
    const auto scores = scores_of(sample::recording_of(still, 10), "hold", {0.05}, sensor);
    // sqrt 3 mm; the RMS of 9450 x 3 normal numbers has a standard error of 0.42 %: four of these.
    EXPECT_NEAR(scores[0].error.position.rms(), std::sqrt(3.0), 0.017 * std::sqrt(3.0));
}

TEST(PredictionError, TheFirstHalfSecondTheEndAndGapsAreNotScored) {
    app::Recording recording = sample::recording_of(sample::sine, 2, 100);
    auto& samples = recording.trace.sticks[0].samples;
    std::erase_if(samples, [](const tracking::PoseSample& s) { return s.t_s > 1.005 && s.t_s < 1.205; });
    const auto scores = scores_of(recording, "hold", {0.05});
    // Samples 0.50 ... 1.00 and 1.21 ... 2.00; truth 50 ms later lies within the recording for those up to
    // 0.95 (then the gap) and up to 1.95. A rounding of t + lead at either end may cost one.
    EXPECT_NEAR(static_cast<double>(scores[0].error.position.count), 46 + 75, 2);
}

TEST(PredictionError, FreeErrorsLeaveOut50MsAboutImpactsAndFlaggedTimes) {
    app::Recording recording = sample::recording_of(sample::strokes, 10, 250);
    ASSERT_EQ(recording.marks[0].impacts_s.size(), 20U);  // lows at 0.25, 0.75, ... 9.75 s
    const auto whole = scores_of(recording, "hold", {0.04});
    // 51 of 500 ms about each low: 25 of 125 samples, of truth times in [0.54, 10].
    const double share =
        static_cast<double>(whole[0].error.free.count) / static_cast<double>(whole[0].error.position.count);
    EXPECT_NEAR(share, 0.8, 0.01);
    EXPECT_EQ(whole[0].error.unflagged.count, whole[0].error.position.count);
    recording.marks[0].flagged_s = {5.5};
    const auto flagged = scores_of(recording, "hold", {0.04});
    // Samples or truths within [5.45, 5.55]: samples of [5.41, 5.55], 35 steps of 4 ms, one more or less at
    // each end by rounding.
    EXPECT_NEAR(static_cast<double>(flagged[0].error.position.count - flagged[0].error.unflagged.count), 35,
                2);
    EXPECT_EQ(flagged[0].error.position.count, whole[0].error.position.count);
    EXPECT_LT(flagged[0].error.free.count, whole[0].error.free.count);
}

/// Normal numbers that do not depend on the standard library.
class Normal {
public:
    double operator()() {
        const double u = (static_cast<double>(random_() >> 11) + 1) / 9007199254740993.0;
        const double v = static_cast<double>(random_() >> 11) / 9007199254740992.0;
        return std::sqrt(-2 * std::log(u)) * std::cos(2 * kPi * v);
    }

private:
    std::mt19937_64 random_{7};
};

/// Errors drawn with covariance S, stated as `stated` S.
app::Calibration calibration_of(double stated) {
    Eigen::Matrix3d root;
    root << 2, 0, 0, 0.5, 1, 0, -0.3, 0.2, 0.4;
    root *= 1e-3;
    app::LeadScore score;
    Normal normal;
    tracking::PoseCovariance covariance;
    covariance.position = stated * root * root.transpose();
    for (int i = 0; i < 20000; ++i) {
        const Eigen::Vector3d z(normal(), normal(), normal());
        tracking::PosePrediction predicted;
        predicted.position = root * z;
        score.add(predicted, app::Truth{}, Eigen::Vector3d::Zero(), covariance);
    }
    return score.calibration().value();
}

TEST(PredictionError, HonestCovariancesCover50And95PercentAndTheirLikelihoodIsTheEntropy) {
    const app::Calibration honest = calibration_of(1);
    EXPECT_NEAR(honest.inside_50, 0.50, 0.0142);  // four standard errors of 20000 draws
    EXPECT_NEAR(honest.inside_95, 0.95, 0.0062);
    // Entropy: 1/2 log((2 pi e)^3 det S), det S = (2 * 1 * 0.4 mm^3)^2; the mean of half a chi-square of 3
    // degrees has a standard error of sqrt(6)/2/sqrt(20000) = 0.0087.
    const double entropy = 1.5 * std::log(2 * kPi * std::exp(1.0)) + std::log(0.8e-9);
    EXPECT_NEAR(honest.negative_log_likelihood, entropy, 0.035);
    EXPECT_EQ(honest.count, 20000U);
}

TEST(PredictionError, CovariancesTooSmallOrTooLargeShowInCoverageAndCostLikelihood) {
    const app::Calibration honest = calibration_of(1), bold = calibration_of(0.25), shy = calibration_of(4);
    // A ball of half the radius holds P(chi2_3 < 7.815 / 4) = 0.418 of the errors, P(chi2_3 < 2.366 / 4) =
    // 0.102; one of twice the radius 0.9769 at 50 %.
    EXPECT_NEAR(bold.inside_95, 0.418, 0.014);
    EXPECT_NEAR(bold.inside_50, 0.102, 0.009);
    EXPECT_NEAR(shy.inside_50, 0.9767, 0.005);
    EXPECT_GT(bold.negative_log_likelihood, honest.negative_log_likelihood + 0.1);
    EXPECT_GT(shy.negative_log_likelihood, honest.negative_log_likelihood + 0.1);
}

TEST(PredictionError, ScoresAddUpAsIfOneRecordingFollowedTheOther) {
    const app::Recording recording = sample::recording_of(sample::strokes, 4, 250);
    const auto hold = scores_of(recording, "hold", {0.05}), thesis = scores_of(recording, "thesis", {0.05});
    app::ErrorScore sum;
    sum.add(hold[0].error);
    sum.add(thesis[0].error);
    const double a = hold[0].error.position.rms(), b = thesis[0].error.position.rms();
    EXPECT_NEAR(sum.position.rms(), std::sqrt((a * a + b * b) / 2), 1e-9);  // as many of each
    EXPECT_EQ(sum.errors_mm.size(), sum.position.count);
    EXPECT_GE(sum.p95_mm(), std::min(hold[0].error.p95_mm(), thesis[0].error.p95_mm()));
    EXPECT_LE(sum.p95_mm(), std::max(hold[0].error.p95_mm(), thesis[0].error.p95_mm()));
}

TEST(PredictionError, PositionsAloneScoreAsTheWholeDoes) {
    tracking::SensorModel sensor;
    sensor.rate_hz = 60;
    sensor.noise_m = 0.00025;
    const std::vector<double> leads_s = {1.0 / 30, 0.1};
    const app::SensedStick stick =
        app::sense_stick(sample::recording_of(sample::steady, 5, 250), 0, sensor, leads_s);
    for (const char* name : {"naive", "cv", "singer"}) {
        const auto whole = app::score_predictor(stick, *tracking::make_predictor(name));
        const auto positions = app::score_positions(stick, *tracking::make_predictor(name));
        for (std::size_t lead = 0; lead < leads_s.size(); ++lead)
            EXPECT_DOUBLE_EQ(positions[lead].rms(), whole[lead].error.position.rms()) << name;
    }
}

}  // namespace
