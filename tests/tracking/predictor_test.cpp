#include "tracking/predictor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace tracking {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

PoseSample sample_at(double t, const Vector3d& position) {
    PoseSample sample;
    sample.t_s = t;
    sample.position = position;
    return sample;
}

PoseSample pose_at(double t, const Vector3d& position, const Quaterniond& q) {
    PoseSample sample = sample_at(t, position);
    sample.orientation = q;
    sample.has_orientation = true;
    return sample;
}

Quaterniond turn(double angle, const Vector3d& axis) {
    return Quaterniond(Eigen::AngleAxisd(angle, axis.normalized()));
}

double angle_between(const Quaterniond& a, const Quaterniond& b) {
    return 2 * std::atan2((a.conjugate() * b).vec().norm(), std::abs((a.conjugate() * b).w()));
}

class EveryPredictor : public testing::TestWithParam<std::string> {};

INSTANTIATE_TEST_SUITE_P(Names, EveryPredictor, testing::ValuesIn(predictor_names()));

TEST_P(EveryPredictor, TakesTheFirstSampleAsItsStateAtRest) {
    const auto predictor = make_predictor(GetParam());
    EXPECT_EQ(predictor->correct(pose_at(5, {1, 2, 3}, turn(1, {1, 2, 3}))), SampleStatus::reinitialised);
    const PosePrediction ahead = predictor->predict(0.1);
    EXPECT_EQ(predictor->time_s(), 5);
    EXPECT_EQ(ahead.position, Vector3d(1, 2, 3));
    EXPECT_EQ(ahead.velocity, Vector3d::Zero());
    EXPECT_EQ(ahead.angular_velocity, Vector3d::Zero());
    EXPECT_LT(angle_between(ahead.orientation, turn(1, {1, 2, 3})), 1e-15);
}

TEST_P(EveryPredictor, IgnoresSamplesThatAreNotNewerOrNotFinite) {
    const auto predictor = make_predictor(GetParam());
    (void)predictor->correct(sample_at(0, {0, 0, 0}));
    (void)predictor->correct(sample_at(0.01, {0.01, 0, 0}));
    const PosePrediction before = predictor->predict(0.03);
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    EXPECT_EQ(predictor->correct(sample_at(0.01, {9, 9, 9})), SampleStatus::not_newer);
    EXPECT_EQ(predictor->correct(sample_at(0.005, {9, 9, 9})), SampleStatus::not_newer);
    EXPECT_EQ(predictor->correct(sample_at(kNan, {0, 0, 0})), SampleStatus::not_finite);
    EXPECT_EQ(predictor->correct(sample_at(0.02, {0, kInfinity, 0})), SampleStatus::not_finite);
    EXPECT_EQ(predictor->correct(pose_at(0.02, {0, 0, 0}, Quaterniond(0, 0, 0, 0))),
              SampleStatus::not_finite);
    EXPECT_EQ(predictor->correct(pose_at(0.02, {0, 0, 0}, Quaterniond(1, kNan, 0, 0))),
              SampleStatus::not_finite);
    EXPECT_EQ(predictor->time_s(), 0.01);
    EXPECT_EQ(predictor->predict(0.03).position, before.position);
    EXPECT_EQ(predictor->correct(sample_at(0.02, {0.02, 0, 0})), SampleStatus::accepted);
}

TEST_P(EveryPredictor, StartsAnewAfterAGapOfMoreThan100Milliseconds) {
    const auto predictor = make_predictor(GetParam());
    for (int i = 0; i <= 10; ++i) (void)predictor->correct(sample_at(i * 0.01, {i * 0.01, 0, 0}));
    EXPECT_EQ(predictor->correct(sample_at(0.1 + kGapS, {0.2, 0, 0})), SampleStatus::accepted);
    EXPECT_EQ(predictor->correct(sample_at(0.35, {0.7, 0, 0})), SampleStatus::reinitialised);
    EXPECT_EQ(predictor->predict(0.1).position, Vector3d(0.7, 0, 0));
    EXPECT_EQ(predictor->predict(0.1).velocity, Vector3d::Zero());
}

TEST_P(EveryPredictor, KeepsTheIdentityForPositionOnlySamples) {
    const auto predictor = make_predictor(GetParam());
    for (int i = 0; i <= 50; ++i) (void)predictor->correct(sample_at(i * 0.01, {std::sin(i * 0.1), 0, 0}));
    EXPECT_EQ(predictor->predict(0.1).orientation.coeffs(), Quaterniond::Identity().coeffs());
    EXPECT_EQ(predictor->predict(0.1).angular_velocity, Vector3d::Zero());
}

TEST_P(EveryPredictor, DoesNotSeeTheSignOfQuaternions) {
    const auto plain = make_predictor(GetParam());
    const auto flipping = make_predictor(GetParam());
    for (int i = 0; i <= 60; ++i) {
        Quaterniond q = turn(0.05 * i, {1, -2, 0.5});
        (void)plain->correct(pose_at(i * 0.01, {0, 0, 0}, q));
        if (i % 3 == 1) q.coeffs() *= -1;
        (void)flipping->correct(pose_at(i * 0.01, {0, 0, 0}, q));
    }
    // The same arithmetic on both signs but for the last bits.
    EXPECT_LT(angle_between(plain->predict(0.05).orientation, flipping->predict(0.05).orientation), 1e-12);
    EXPECT_LT((plain->predict(0.05).angular_velocity - flipping->predict(0.05).angular_velocity).norm(),
              1e-10);
}

TEST_P(EveryPredictor, IsUnchangedByTurningTheWorld) {
    // Strokes turn back up: that one knows which way is up.
    const Quaterniond world = turn(1.1, GetParam() == "surface" ? Vector3d(0, 1, 0) : Vector3d(0.3, 1, -2));
    const auto plain = make_predictor(GetParam());
    const auto turned = make_predictor(GetParam());
    for (int i = 0; i <= 40; ++i) {
        const Vector3d p(0.3 * std::sin(0.15 * i), 0.2 * std::cos(0.2 * i), 0.01 * i);
        const Quaterniond q = turn(0.5 * std::sin(0.15 * i), {1, 0.2, 0}) * turn(0.02 * i, {0, 1, 0});
        (void)plain->correct(pose_at(i / 120.0, p, q));
        (void)turned->correct(pose_at(i / 120.0, world * p, world * q));
    }
    const PosePrediction a = plain->predict(1.0 / 15);
    const PosePrediction b = turned->predict(1.0 / 15);
    if (GetParam() == "imm") {
        // Each axis has a covariance of its own (the modes' spread differs), so turning the axes changes the
        // prediction, by far less than its error (centimetres here).
        EXPECT_LT((world * a.position - b.position).norm(), 1e-3);
        return;
    }
    // Noise is alike in all directions, so only rounding differs (accelerations of 100 m/s^2 amplify it).
    EXPECT_LT((world * a.position - b.position).norm(), 1e-12);
    EXPECT_LT((world * a.velocity - b.velocity).norm(), 1e-10);
    EXPECT_LT(angle_between(world * a.orientation, b.orientation), 1e-11);
    EXPECT_LT((world * a.angular_velocity - b.angular_velocity).norm(), 1e-9);
}

TEST_P(EveryPredictor, FindsAConstantAngularVelocityOf10RadPerSecond) {
    const Vector3d w = 10 * Vector3d(1, 2, -2).normalized();
    const auto predictor = make_predictor(GetParam());
    const auto at = [&](double t) { return turn(10 * t, w) * turn(0.7, {0, 1, 1}); };
    constexpr int kLast = 1000;
    for (int i = 0; i <= kLast; ++i) (void)predictor->correct(pose_at(i / 120.0, {0, 0, 0}, at(i / 120.0)));
    const PosePrediction ahead = predictor->predict(1.0 / 15);
    if (GetParam() == "hold") {
        EXPECT_LT(angle_between(ahead.orientation, at(kLast / 120.0)), 1e-12);
        return;
    }
    EXPECT_LT((ahead.angular_velocity - w).norm(), 1e-6);
    // The moving average of 8 samples lags 3.5 of them, the 1 euro filter (1 - share) / share of one at its
    // cut-off of 10 Hz + 0.1 Hz s/mm * 10 rad/s * 400 mm; the others are on the turn.
    const double unseen = 1 / (2 * M_PI * (10 + 0.1 * 10 * 400) / 120);
    const double lag = GetParam() == "naive" ? 3.5 / 120 : GetParam() == "one-euro" ? unseen / 120 : 0;
    EXPECT_LT(angle_between(ahead.orientation, at(kLast / 120.0 + 1.0 / 15 - lag)), 1e-6);
}

TEST(Difference, ExtrapolatesTheLastTwoSamples) {
    const auto predictor = make_predictor("difference");
    (void)predictor->correct(sample_at(0, {9, 9, 9}));
    (void)predictor->correct(sample_at(0.01, {1, 2, 3}));
    (void)predictor->correct(sample_at(0.03, {1.02, 2, 2.98}));
    EXPECT_LT((predictor->predict(0.1).position - Vector3d(1.12, 2, 2.88)).norm(), 1e-14);
    EXPECT_LT((predictor->predict(0.1).velocity - Vector3d(1, 0, -1)).norm(), 1e-12);
}

TEST(Naive, AveragesFourSamplesStartingFromABufferFullOfTheFirst) {
    const auto predictor = make_predictor("naive:n=4");
    (void)predictor->correct(sample_at(0, {0, 0, 0}));
    (void)predictor->correct(sample_at(0.01, {4, 0, 0}));
    EXPECT_NEAR(predictor->predict(0).position.x(), 1, 1e-15);
    EXPECT_NEAR(predictor->predict(0).velocity.x(), 100, 1e-12);
    for (int i = 2; i <= 9; ++i) (void)predictor->correct(sample_at(i * 0.01, {4.0 * i, 0, 0}));
    // Steady motion: the mean lags by 1.5 samples.
    EXPECT_NEAR(predictor->predict(0.02).position.x(), 4 * (9 - 1.5 + 2), 1e-12);
}

TEST(Naive, WindowOf67MillisecondsHolds4SamplesAt60HertzAnd8At120) {
    for (const auto& [rate, n] : {std::pair<double, int>{60, 4}, {120, 8}}) {
        const auto predictor = make_predictor("naive");
        for (int i = 0; i <= 60; ++i) (void)predictor->correct(sample_at(i / rate, {i / rate, 0, 0}));
        EXPECT_NEAR(predictor->predict(0).position.x(), (60 - (n - 1) / 2.0) / rate, 1e-13) << rate;
    }
}

TEST(Gate, RefusesASingleImpossibleSampleAndStaysOnTheMotion) {
    const auto gated = make_predictor("ca:gate=5");
    const auto named = make_predictor("ca:q=1e9");
    for (int i = 0; i <= 40; ++i) {
        const double t = i / 120.0;
        const Vector3d p = i == 35 ? Vector3d(0.5, 1, 0) : Vector3d(t, 1, 0);
        EXPECT_EQ(gated->correct(sample_at(t, p)), i == 0    ? SampleStatus::reinitialised
                                                   : i == 35 ? SampleStatus::outlier
                                                             : SampleStatus::accepted);
        (void)named->correct(sample_at(t, p));
        if (i != 35) continue;
        EXPECT_LT((gated->predict(1.0 / 120).position - Vector3d(t, 1, 0)).norm(), 1e-3);
    }
    const Vector3d expected(40 / 120.0 + 1.0 / 15, 1, 0);
    EXPECT_LT((gated->predict(1.0 / 15).position - expected).norm(), 1e-3);
    EXPECT_GT((named->predict(1.0 / 15).position - expected).norm(), 1e-2);  // named filters do not gate
}

TEST(Gate, AcceptsANewPlaceThatPersistsForThreeSamples) {
    const auto predictor = make_predictor("ca:gate=5");
    for (int i = 0; i <= 20; ++i) (void)predictor->correct(sample_at(i / 240.0, {0, 1, 0}));
    EXPECT_EQ(predictor->correct(sample_at(21 / 240.0, {2, 1, 0})), SampleStatus::outlier);
    EXPECT_EQ(predictor->correct(sample_at(22 / 240.0, {2, 1, 0})), SampleStatus::outlier);
    EXPECT_EQ(predictor->correct(sample_at(23 / 240.0, {2, 1, 0})), SampleStatus::reinitialised);
    EXPECT_EQ(predictor->predict(0).position, Vector3d(2, 1, 0));
}

TEST(Gate, AcceptsAContactThatTurns8MetresPerSecondRoundBetweenTwoSamples) {
    for (const double rate : {60.0, 120.0, 250.0, 500.0}) {
        const auto predictor = make_predictor("ca:gate=5");
        for (int i = -30; i <= 30; ++i) {
            const double t = i / rate;
            const SampleStatus status = predictor->correct(sample_at(t, {0, t < 0 ? -8 * t : 5 * t, 0}));
            EXPECT_EQ(status, i == -30 ? SampleStatus::reinitialised : SampleStatus::accepted)
                << rate << " Hz, sample " << i;
        }
    }
}

TEST(Gate, CanBeAskedForOnANamedFilter) {
    const auto predictor = make_predictor("cv:q=1e8,gate=5");
    for (int i = 0; i <= 20; ++i) (void)predictor->correct(sample_at(i / 240.0, {0, 1, 0}));
    EXPECT_EQ(predictor->correct(sample_at(21 / 240.0, {2, 1, 0})), SampleStatus::outlier);
}

TEST(PointOf, FollowsATipOnATurningBody) {
    PosePrediction pose;
    pose.position = {1, 1, 1};
    pose.velocity = {0, 0, 2};
    pose.orientation = turn(std::numbers::pi / 2, {0, 1, 0});
    pose.angular_velocity = {0, 3, 0};
    const PointMotion tip = point_of(pose, {0, 0, -0.4});
    EXPECT_LT((tip.position - Vector3d(0.6, 1, 1)).norm(), 1e-15);
    EXPECT_LT((tip.velocity - Vector3d(0, 0, 2 + 3 * 0.4)).norm(), 1e-15);
}

TEST(MakePredictor, RefusesWhatItDoesNotKnowInOneLine) {
    for (const char* text : {"",
                             "kalman",
                             "CA",
                             "ca:",
                             "ca:q",
                             "ca:q=",
                             "ca:=1",
                             "ca:q=abc",
                             "ca:q=1e9,q=1e9",
                             "ca:q=-1",
                             "ca:q=nan",
                             "ca:q=inf",
                             "ca:q=1e9,",
                             "ca:alpha=3",
                             "hold:n=1",
                             "naive:n=0",
                             "naive:n=2.5",
                             "naive:n=100000",
                             "thesis:q=inner",
                             "singer:alpha=0",
                             "auto",
                             "ca:gate=0",
                             "ca:q=1e9\nx",
                             "a\nb"}) {
        try {
            (void)make_predictor(text);
            ADD_FAILURE() << text;
        } catch (const std::invalid_argument& error) {
            const std::string message = error.what();
            EXPECT_NE(message.find("found "), std::string::npos) << message;
            EXPECT_NE(message.find(", expected "), std::string::npos) << message;
            EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        }
    }
}

TEST(MakePredictor, NamesEveryParameterWhereOneIsUnknown) {
    try {
        (void)make_predictor("surface:colour=1");
        ADD_FAILURE();
    } catch (const std::invalid_argument& error) {
        EXPECT_STREQ(error.what(),
                     "predictor 'surface:colour=1': found parameter 'colour', expected only decay, gate, p0, "
                     "q, r, v0");
    }
}

TEST(MakePredictor, KnowsTheDocumentedSpecifications) {
    for (const char* text : {"naive", "naive:n=4", "thesis", "thesis:q=outer", "ca:q=1e9", "cv:q=1e8",
                             "singer:alpha=3,q=1e10", "hold", "difference", "ca:gate=5"})
        EXPECT_NO_THROW((void)make_predictor(text)) << text;
}

}  // namespace
}  // namespace tracking
