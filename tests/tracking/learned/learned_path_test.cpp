// The network's path: its frame, its laws, what it promises as a predictor.
#include "learned/learned_path.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>

#include "learned/model_of_random_weights.h"
#include "tracking/rotation.h"

namespace tracking {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

const Vector3d kAlongShaft(0, 1, 0);

PoseSample sample_at(double t_s, const Vector3d& position, const Quaterniond& orientation) {
    return {t_s, position, orientation, true};
}

/// A stick that strikes and sways, at uneven times.
PoseSample stroke(int i, double phase = 0) {
    const double t = i / 70.0 + 0.002 * std::sin(3.0 * i), s = 9 * t + phase;
    const Vector3d p(0.1 * std::sin(0.7 * s), 0.9 + 0.2 * std::abs(std::sin(s)), 0.3 + 0.15 * std::cos(s));
    return sample_at(t, p,
                     Quaterniond(AngleAxisd(0.8 * std::sin(s), Vector3d(1, 0.2, 0.1).normalized()) *
                                 AngleAxisd(-1.2, Vector3d::UnitX())));
}

Learned learned(std::size_t hidden = 24, std::uint64_t seed = 5) {
    return {model_of_random_weights(hidden, seed), kAlongShaft};
}

void feed_strokes(Learned& predictor, int count) {
    for (int i = 0; i < count; ++i) (void)predictor.correct(stroke(i));
}

TEST(LearnedPath, TurnsAndMovesWithTheKit) {
    const Quaterniond yaw(AngleAxisd(2.1, Vector3d::UnitY()));
    const Vector3d shift(12, -3, 400);
    Learned here = learned(), there = learned();
    for (int i = 0; i < 60; ++i) {
        const PoseSample s = stroke(i);
        (void)here.correct(s);
        (void)there.correct(sample_at(s.t_s + 7, yaw * s.position + shift, yaw * s.orientation));
        for (const double lead : {0.01, 1.0 / 30, 0.08, 0.2}) {
            const PosePrediction a = here.predict(lead), b = there.predict(lead);
            // Positions of 400 m have 1e-13 m of rounding, over 1/120 s it is 1e-11 m/s; floats of the inputs may
            // fall on the other side, 1e-7 of 2 m/s for 0.15 s.
            EXPECT_LT((yaw * a.position + shift - b.position).norm(), 1e-6) << i << ' ' << lead;
            EXPECT_LT((yaw * a.velocity - b.velocity).norm(), 1e-4) << i << ' ' << lead;
            EXPECT_LT((yaw * a.orientation).angularDistance(b.orientation), 1e-5) << i << ' ' << lead;
        }
        const Eigen::Matrix3d rotation = yaw.toRotationMatrix();
        const Eigen::Matrix3d a = rotation * here.covariance(0.05)->position * rotation.transpose(),
                              b = there.covariance(0.05)->position;
        EXPECT_LT((a - b).norm(), 1e-4 * b.norm());
    }
}

TEST(LearnedPath, GoesThroughTheNetworksAnswersAndItsVelocityIsItsSlope) {
    PathFrame frame;
    frame.position = {1, 2, 3};
    frame.velocity = {0.5, -2, 1};
    frame.direction = Vector3d(1, 2, 2) / 3;
    frame.angular_velocity = frame.direction.cross(Vector3d(3, 1, -5));
    frame.cosine = 0.6, frame.sine = 0.8;
    frame.speed = 2.5;
    PathMeans outputs;
    for (Eigen::Index i = 0; i < outputs.size(); ++i)
        outputs[i] = 0.02F * static_cast<float>(std::sin(1.7 * i));
    const LearnedPath path(frame, outputs, Quaterniond::FromTwoVectors(kAlongShaft, frame.direction));
    for (std::size_t l = 0; l < kNodes; ++l) {
        const auto at = static_cast<Eigen::Index>(6 * l);
        const Vector3d added = frame.speed * frame.to_world(outputs.segment<3>(at).cast<double>());
        const PosePrediction pose = path.after(kPathLeads[l]);
        EXPECT_LT((pose.position - frame.faded_position(kPathLeads[l]) - added).norm(), 1e-14);
        const Vector3d shaft = frame.faded_direction(kPathLeads[l]) +
                               frame.speed / 0.4 * frame.to_world(outputs.segment<3>(at + 3).cast<double>());
        EXPECT_LT((pose.orientation * kAlongShaft - shaft.normalized()).norm(), 1e-12);
    }
    constexpr double kStep = 1e-6;  // a difference over it errs by its square times the third derivative
    for (const double lead : {0.005, 0.02, 0.05, 0.09, 0.12, 0.149, 0.2, 0.5}) {
        const PosePrediction before = path.after(lead - kStep), at = path.after(lead),
                             after = path.after(lead + kStep);
        EXPECT_LT((at.velocity - (after.position - before.position) / (2 * kStep)).norm(), 1e-6) << lead;
        const Vector3d turning = at.angular_velocity.cross(at.orientation * kAlongShaft);
        const Vector3d turned =
            (after.orientation * kAlongShaft - before.orientation * kAlongShaft) / (2 * kStep);
        EXPECT_LT((turning - turned).norm(), 1e-5) << lead;
    }
    EXPECT_EQ(path.after(0).position, frame.position);
}

TEST(LearnedPath, EvaluatesTheNetworkThatItsModelStates) {
    RandomStream random(9);
    for (const std::size_t hidden : {4, 7, 24, 32, 40, 64, 65, 100, 128}) {
        const PathModel model = model_of_random_weights(hidden, hidden);
        StickHistory::Inputs inputs;
        for (float& x : inputs) x = random.uniform() < 0.3 ? 0.0F : static_cast<float>(random.normal());
        if (hidden % 2 == 0) inputs.segment<43>(39).setZero();  // without a direction
        const Network network(model);
        Network::Hidden hidden_units;
        network.find_hidden(inputs, hidden_units);
        Eigen::VectorXf outputs(kPathOutputs);
        outputs << network.means(hidden_units), network.spreads(hidden_units);
        Eigen::VectorXd h = inputs.cast<double>();
        for (std::size_t l = 0; l < model.layers.size(); ++l) {
            h = (model.layers[l].weights.cast<double>() * h + model.layers[l].bias.cast<double>()).eval();
            if (l < 2) h = h.cwiseMax(0.1 * h).eval();
        }
        // 300 roundings of 6e-8 of sums of order 1.
        EXPECT_LT((outputs.cast<double>() - h).cwiseAbs().maxCoeff(), 2e-6) << hidden;
    }
}

TEST(LearnedPath, WithoutAnswersIsTheFadingVelocity) {
    Learned zero(model_of_zeros(), kAlongShaft);
    const Vector3d v(1.5, -0.5, 0.25);
    const Quaterniond q(AngleAxisd(0.4, Vector3d::UnitZ()));
    for (int i = 0; i <= 40; ++i) (void)zero.correct(sample_at(i / 60.0, i / 60.0 * v, q));
    for (const double lead : {1.0 / 30, 0.1, 0.15}) {
        const double way = (1 - std::exp(-8 * lead)) / 8;
        EXPECT_LT((zero.predict(lead).position - (40 / 60.0 + way) * v).norm(), 1e-12);
        EXPECT_LT(zero.predict(lead).orientation.angularDistance(q), 1e-12);
    }
}

TEST(LearnedPath, StatesACovarianceThatGrowsAndIsThatOfItsWhitening) {
    PathSpreads spreads = PathSpreads::Zero();
    spreads.head<kShapeNumbers>() << -3, -2, -2.5F, 0.4F, -0.3F, 0.7F, -2;
    const ErrorShape shape = shape_of(spreads, 0);
    const Eigen::Matrix3d inverse = shape.covariance().inverse();
    for (const Vector3d& e : {Vector3d(0.1, 0.02, -0.03), Vector3d(-0.01, 0.2, 0.05)})
        EXPECT_NEAR(e.dot(inverse * e), shape.whitened(e).squaredNorm(), 1e-10);
    Learned predictor = learned();
    feed_strokes(predictor, 50);
    for (const double lead : {0.0, 0.01, 0.04, 0.1, 0.15, 0.4}) {
        const Eigen::Matrix3d c = predictor.covariance(lead)->position;
        EXPECT_LT((c - c.transpose()).norm(), 1e-12 * c.norm());
        EXPECT_EQ(Eigen::LLT<Eigen::Matrix3d>(c).info(), Eigen::Success) << lead << ": not positive definite";
    }
}

TEST(Learned, HoldsAfterOneSampleAndStartsAnewAfterAGap) {
    Learned predictor = learned();
    const PoseSample first = stroke(0);
    EXPECT_EQ(predictor.correct(first), SampleStatus::reinitialised);
    EXPECT_EQ(predictor.predict(0.1).position, first.position);
    EXPECT_EQ(predictor.predict(0.1).velocity, Vector3d::Zero());
    EXPECT_LT(predictor.predict(0.1).orientation.angularDistance(first.orientation), 1e-15);
    feed_strokes(predictor, 50);
    PoseSample late = stroke(50);
    late.t_s += 0.2;
    EXPECT_EQ(predictor.correct(late), SampleStatus::reinitialised);
    EXPECT_EQ(predictor.predict(0.1).position, late.position);
    Learned fresh = learned();
    (void)fresh.correct(late);
    for (int i = 51; i < 80; ++i) {
        PoseSample s = stroke(i);
        s.t_s += 0.2;
        (void)predictor.correct(s);
        (void)fresh.correct(s);
        EXPECT_EQ(predictor.predict(0.07).position, fresh.predict(0.07).position);
    }
}

TEST(Learned, RefusesWhatIsNotNewerOrNotFinite) {
    Learned plain = learned(), pestered = learned();
    for (int i = 0; i < 40; ++i) {
        PoseSample s = stroke(i);
        (void)plain.correct(s);
        EXPECT_TRUE(is_taken(pestered.correct(s)));
        EXPECT_EQ(pestered.correct(s), SampleStatus::not_newer);
        s.t_s += 0.001;
        s.position.y() = std::numeric_limits<double>::quiet_NaN();
        EXPECT_EQ(pestered.correct(s), SampleStatus::not_finite);
        EXPECT_EQ(pestered.predict(0.05).position, plain.predict(0.05).position);
    }
}

TEST(Learned, DoesNotSeeTheSignOfQuaternions) {
    Learned plain = learned(), flipping = learned();
    for (int i = 0; i < 40; ++i) {
        PoseSample s = stroke(i);
        (void)plain.correct(s);
        if (i % 3 == 1) s.orientation.coeffs() *= -1;
        (void)flipping.correct(s);
        EXPECT_LT((plain.predict(0.05).position - flipping.predict(0.05).position).norm(), 1e-12);
        EXPECT_LT(plain.predict(0.05).orientation.angularDistance(flipping.predict(0.05).orientation), 1e-7);
    }
}

TEST(Learned, WithoutOrientationsKeepsTheIdentity) {
    Learned predictor = learned();
    for (int i = 0; i < 40; ++i) (void)predictor.correct({stroke(i).t_s, stroke(i).position});
    EXPECT_EQ(predictor.predict(0.1).orientation.coeffs(), Quaterniond::Identity().coeffs());
    EXPECT_EQ(predictor.predict(0.1).angular_velocity, Vector3d::Zero());
}

TEST(Learned, SeesOnlyTheLast250Milliseconds) {
    // Other strokes, then the same for 0.35 s: nothing of the first is left.
    Learned one = learned(), other = learned();
    for (int i = 0; i < 60; ++i) {
        (void)one.correct(stroke(i));
        (void)other.correct(stroke(i, i < 30 ? 2 : 0));
    }
    EXPECT_EQ(one.predict(0.1).position, other.predict(0.1).position);
}

TEST(Learned, MeansTheSameAtAnyRateWhereTheMotionIsStraight) {
    // Interpolation between samples loses nothing of a straight path, so only the periods among the inputs differ.
    PathModel model = model_of_random_weights(24, 5);
    constexpr auto kPeriods = static_cast<Eigen::Index>(StickHistory::kInputs - StickHistory::kPeriods - 1);
    model.layers[0].weights.middleCols(kPeriods, StickHistory::kPeriods).setZero();
    Learned slow(model, kAlongShaft), fast(model, kAlongShaft);
    const auto at = [](double t) { return PoseSample{t, Vector3d(1, 0.5, -0.3) * t}; };
    for (int i = 0; i <= 40; ++i) (void)slow.correct(at(i / 40.0));
    for (int i = 0; i <= 250; ++i) (void)fast.correct(at(i / 250.0));
    EXPECT_LT((slow.predict(0.1).position - fast.predict(0.1).position).norm(),
              1e-6);  // floats of the inputs
}

}  // namespace
}  // namespace tracking
