#include "tracking/motion.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "trace/random_stream.h"
#include "tracking/predictor.h"

namespace tracking {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

/// A stick that wanders and turns at random, sampled at uneven times, with drop-outs of orientation and gaps
/// after which predictors start anew.
class RandomStick {
public:
    RandomStick(std::uint64_t seed, bool with_orientation)
        : random_(seed), with_orientation_(with_orientation) {}

    PoseSample next() {
        const bool gap = random_.uniform() < 0.01;
        const double dt = gap ? 0.2 : 0.004 + 0.012 * random_.uniform();
        sample_.t_s += dt;
        velocity_ = 0.8 * velocity_ + random_.normal_vector(1);
        spin_ = 0.8 * spin_ + 5 * random_.normal_vector(1);
        sample_.position = 0.99 * sample_.position + dt * velocity_;
        const Vector3d turn = std::min(dt, 0.02) * spin_;
        sample_.orientation =
            Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized())) * sample_.orientation;
        sample_.orientation.normalize();
        sample_.has_orientation = with_orientation_ && random_.uniform() < 0.9;
        return sample_;
    }

private:
    RandomStream random_;
    bool with_orientation_;
    Vector3d velocity_ = Vector3d::Zero(), spin_ = Vector3d::Zero();  // [m/s], [rad/s]
    PoseSample sample_;
};

/// The largest difference of any number of two predictions.
double difference(const PosePrediction& a, const PosePrediction& b) {
    return std::max({(a.position - b.position).cwiseAbs().maxCoeff(),
                     (a.velocity - b.velocity).cwiseAbs().maxCoeff(),
                     (a.orientation.coeffs() - b.orientation.coeffs()).cwiseAbs().maxCoeff(),
                     (a.angular_velocity - b.angular_velocity).cwiseAbs().maxCoeff()});
}

/// Of predict(lead) and motion()->after(lead), over 2000 random samples and leads from 0 to 0.15 s, from
/// before the second sample on and across gaps.
double largest_difference(const std::string& specification, bool with_orientation) {
    const auto predictor = make_predictor(specification);
    RandomStick stick(7, with_orientation);
    double largest = 0;
    for (int i = 0; i < 2000; ++i) {
        (void)predictor->correct(stick.next());
        const std::optional<Motion> motion = predictor->motion();
        if (!motion) return 1e9;
        for (const double lead : {0.0, 0.001, 1.0 / 30, 1.0 / 15, 0.15})
            largest = std::max(largest, difference(predictor->predict(lead), motion->after(lead)));
    }
    return largest;
}

class EveryMotion : public testing::TestWithParam<std::string> {};

std::vector<std::string> specifications() {
    std::vector<std::string> all = predictor_names();
    std::erase(all, "surface");  // a path that rebounds is none of these motions
    all.insert(all.end(),
               {"cv:decay=8", "cv:decay=8,gate=5", "ca:steady=60", "ca:gate=5", "singer:alpha=300",
                "bank:score=likelihood", "thesis:q=outer", "naive:n=4", "least-squares:degree=0,n=3",
                "least-squares:degree=1,n=5", "least-squares:degree=2,n=3", "least-squares:degree=2,n=9"});
    return all;
}

INSTANTIATE_TEST_SUITE_P(Specifications, EveryMotion, testing::ValuesIn(specifications()));

bool is_kalman(const std::string& specification) {
    static const std::set<std::string> names = {"thesis", "cv", "ca", "singer", "bank", "imm"};
    return names.contains(specification.substr(0, specification.find(':')));
}

/// Kalman filters: to the bit, since both use the same functions in the same order. Others sum the same terms
/// in another order: a few roundings of numbers below 1000 (m/s, rad/s).
TEST_P(EveryMotion, PredictsWhatItsPredictorPredicts) {
    for (const bool with_orientation : {false, true})
        EXPECT_LE(largest_difference(GetParam(), with_orientation), is_kalman(GetParam()) ? 0 : 1e-12)
            << (with_orientation ? "with" : "without") << " orientation";
}

TEST(Motion, OfAPolynomialOfDegreeThreeOrOfAPathThatReboundsIsNone) {
    for (const char* name : {"least-squares:degree=3", "surface"}) {
        const auto predictor = make_predictor(name);
        RandomStick stick(7, true);
        for (int i = 0; i < 10; ++i) (void)predictor->correct(stick.next());
        EXPECT_FALSE(predictor->motion()) << name;
    }
}

/// The poses that a polynomial of degree 3 predicts, at leads from 0 to 0.15 s in nine steps.
SampledMotion sampled_from(const Predictor& predictor) {
    SampledMotion sampled(0.15, 9);
    for (std::size_t i = 0; i <= sampled.pieces(); ++i) sampled.set(i, predictor.predict(sampled.lead_s(i)));
    return sampled;
}

TEST(SampledMotion, IsItsSamplesToTheBitAndACubicBetweenThem) {
    const auto predictor = make_predictor("least-squares:degree=3,n=12");
    RandomStick stick(7, true);
    for (int i = 0; i < 200; ++i) {
        (void)predictor->correct(stick.next());
        const SampledMotion sampled = sampled_from(*predictor);
        for (std::size_t k = 0; k <= sampled.pieces(); ++k)
            EXPECT_EQ(difference(sampled.after(sampled.lead_s(k)), predictor->predict(sampled.lead_s(k))), 0);
        for (const double lead : {0.001, 1.0 / 30, 0.07, 0.149}) {
            const PosePrediction own = sampled.after(lead), whole = predictor->predict(lead);
            // A cubic piece is the cubic itself: rounding of numbers below 1e3.
            EXPECT_LT((own.position - whole.position).norm(), 1e-11);
            EXPECT_LT((own.velocity - whole.velocity).norm(), 1e-9);
        }
    }
}

/// A turn at 30 rad/s and a push of 50 m/s^2, sampled at three poses: between them the same, beyond at the last
/// velocities.
TEST(SampledMotion, TurnsAtAConstantRateAndGoesOnWithTheLastVelocities) {
    Motion motion;
    motion.velocity = Vector3d(1, 2, 3);
    motion.acceleration = Vector3d(0, -50, 0);
    motion.angular_velocity = Vector3d(10, -20, 20);
    SampledMotion sampled(0.1, 2);
    for (std::size_t i = 0; i <= 2; ++i) sampled.set(i, motion.after(sampled.lead_s(i)));
    for (const double lead : {0.0, 0.02, 0.05, 0.09, 0.1})
        EXPECT_LT(difference(sampled.after(lead), motion.after(lead)), 1e-12) << lead;
    const PosePrediction last = motion.after(0.1), beyond = sampled.after(0.13);
    EXPECT_LT((beyond.position - last.position - 0.03 * last.velocity).norm(), 1e-12);
    EXPECT_LT((beyond.orientation.coeffs() - motion.after(0.13).orientation.coeffs()).norm(), 1e-12);
}

/// What one predictor's Motion says differs from another's: the test above would not pass by chance.
TEST(Motion, DiffersBetweenPredictors) {
    RandomStick stick(7, true);
    const auto one = make_predictor("cv"), other = make_predictor("cv:decay=8");
    for (int i = 0; i < 10; ++i) {
        const PoseSample sample = stick.next();
        (void)one->correct(sample);
        (void)other->correct(sample);
    }
    EXPECT_GT(difference(one->motion()->after(0.05), other->motion()->after(0.05)), 1e-3);
}

/// In closed form: 1 m/s and 20 m/s^2 over 0.1 s; velocity that decays at 10 /s; acceleration that does.
TEST(Motion, FollowsItsLaw) {
    Motion motion;
    motion.velocity = Vector3d(1, 0, 0);
    motion.acceleration = Vector3d(20, 0, 0);
    EXPECT_NEAR(motion.after(0.1).position.x(), 0.2, 1e-15);
    EXPECT_NEAR(motion.after(0.1).velocity.x(), 3, 1e-15);
    motion.rate = 10;
    motion.law = MotionLaw::decaying_velocity;
    EXPECT_NEAR(motion.after(0.1).position.x(), (1 - std::exp(-1)) / 10, 1e-15);
    EXPECT_NEAR(motion.after(0.1).velocity.x(), std::exp(-1), 1e-15);
    motion.law = MotionLaw::decaying_acceleration;
    EXPECT_NEAR(motion.after(0.1).position.x(), 0.1 + 20 * std::exp(-1) / 100, 1e-15);
    EXPECT_NEAR(motion.after(0.1).velocity.x(), 1 + 20 * (1 - std::exp(-1)) / 10, 1e-15);
}

}  // namespace
}  // namespace tracking
