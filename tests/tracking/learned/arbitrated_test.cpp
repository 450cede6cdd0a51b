#include "learned/arbitrated.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <deque>
#include <functional>

#include "learned/model_of_random_weights.h"
#include "tracking/sensor.h"

namespace tracking {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr const char* kFilter = "cv:q=1e7,decay=8,r=0.5,gate=5";
const Vector3d kShaftAxis = Vector3d::UnitY();

Arbitrated arbitrated(const PathModel& model, double memory_s = 0) {
    return {make_predictor(kFilter), model, kShaftAxis, memory_s};
}

/// Right for constant velocity upwards: takes the fading back.
PathModel lasting_velocity() {
    PathModel lasting = model_of_zeros();
    for (std::size_t l = 0; l < kNodes; ++l) {
        // Velocities of the newest two spans are inputs over the speed; the first layers pass +x and -x.
        const auto row = static_cast<Eigen::Index>(6 * l);
        const double missing = kPathLeads[l] - fading_way(kPathLeads[l]);
        lasting.layers[2].weights(row + 1, 0) = static_cast<float>(missing);
        lasting.layers[2].weights(row + 1, 1) = static_cast<float>(-missing);
    }
    for (PathModel::Layer* layer : {&lasting.layers[0], &lasting.layers[1]}) layer->weights.setZero();
    lasting.layers[0].weights(0, 1) = 1, lasting.layers[0].weights(1, 1) = -1;  // upward velocity
    lasting.layers[1].weights(0, 0) = lasting.layers[1].weights(1, 1) = 1;
    // f(f(x)) - f(f(-x)) = (1 + 0.01) x
    lasting.layers[2].weights /= 1.01F;
    return lasting;
}

PoseSample upwards(int i) {
    return {i / 60.0, {0, 0.8 * i / 60.0, 0}};
}

/// Motion of many kinds, none of which a network of random weights knows.
PoseSample motion(int kind, int i) {
    const double t = i / 60.0, s = std::sin(7 * t), c = std::cos(11 * t);
    Vector3d p = Vector3d::Zero();
    if (kind == 0) p = {0.3 * s, 0.2 * std::abs(c), 0.1 * t};
    if (kind == 1) p = {std::floor(2 * t) * 0.3, 0.9, 0};                        // leaps
    if (kind == 2) p = {0.2 * std::sin(t * t), 0.4 * std::sin(3 * t * t), 0.1};  // a chirp
    if (kind == 3) p = {t, 2 * t, -t};
    if (kind == 4)
        p = 0.001 * Vector3d(std::sin(31.0 * i), std::cos(17.0 * i), std::sin(5.0 * i * i));  // noise
    if (kind == 5)
        p = {0, 0.5 * std::abs(std::sin(9 * t)) * (std::fmod(t, 4) < 2 ? 1 : 0.1), 0};  // comes and goes
    return {t, p, Quaterniond(Eigen::AngleAxisd(s, Vector3d::UnitX())), true};
}
constexpr int kKinds = 6;

/// RMS of predictions 1/15 s ahead against the path itself.
double rms_of(Predictor& predictor, int kind, int count) {
    double sum = 0;
    for (int i = 0; i < count; ++i) {
        (void)predictor.correct(motion(kind, i));
        sum += (predictor.predict(4 / 60.0).position - motion(kind, i + 4).position).squaredNorm();
    }
    return std::sqrt(sum / count);
}

TEST(Arbiter, FindsTheShareOfLeastSquares) {
    // Errors of the filter e, of the model -e / 2: p = F + a (M - F) is right with a = 2/3.
    Arbiter arbiter;
    for (int i = 0; i < 600; ++i) {
        const Vector3d e = Vector3d(std::sin(0.3 * i), std::cos(0.7 * i), 1);
        arbiter.learn(e, -e / 2, Vector3d::Zero(), 1 / 60.0);
        if (i < 14) {
            EXPECT_EQ(arbiter.share(), 0) << "nothing before 0.25 s";
        }
        if (i > 15) {
            EXPECT_NEAR(arbiter.share(), 2.0 / 3, 1e-7) << "rounding, under a root";
        }
    }
}

TEST(Arbiter, FollowsOnlyAsFarAsLeastSquaresIsSure) {
    // The model takes one component of the error away; the other, as large as `left`, stays: a = 1, and the variance
    // of a is left^2 over the number of independent errors. It counts the less the further the model's mean square is
    // below 0.85^2 of the filter's, and below 0.7^2 not at all.
    for (const double left : {0.5, 1.2, 1.5}) {
        Arbiter arbiter;
        for (int i = 0; i < 6000; ++i)
            arbiter.learn(Vector3d(1, left, 0), Vector3d(0, left, 0), Vector3d::Zero(), 1 / 60.0);
        const double ratio = left * left / (1 + left * left);
        const double doubt = std::max(0.0, (ratio - 0.49) / (0.7225 - 0.49));
        EXPECT_NEAR(arbiter.share(), 1 - doubt * left * std::sqrt(0.15 / 2), 1e-9) << left;
    }
}

TEST(Arbiter, TrustsNoModelThatIsNotClearlyBetter) {
    for (const double of_filter : {0.84, 0.86, 1.0, 1.2}) {
        Arbiter arbiter;
        for (int i = 0; i < 6000; ++i) {
            const Vector3d e(std::sin(0.3 * i), 0, 0), other(0, of_filter * std::sin(0.3 * i), 0);
            arbiter.learn(e, other, Vector3d::Zero(), 1 / 60.0);
        }
        EXPECT_EQ(arbiter.share() > 0, of_filter < 0.85) << of_filter;
    }
}

TEST(Arbiter, ForgetsAModelThatTurnsBad) {
    Arbiter arbiter;
    const Vector3d right = Vector3d::Zero(), wrong(0.1, 0, 0), worse(0.3, 0, 0);
    for (int i = 0; i < 600; ++i) arbiter.learn(wrong, right, right, 1 / 60.0);
    EXPECT_EQ(arbiter.share(), 1);
    int samples = 0;
    for (; arbiter.share() > 0.2; ++samples) arbiter.learn(wrong, worse, right, 1 / 60.0);
    EXPECT_LT(samples, 120) << "the two seconds of its memory";
}

/// Shares of the squares within the regions that a scale states, each learned from four errors later, as with a lead.
std::pair<double, double> shares_within(const std::function<double()>& square, int count) {
    RegionScale scale;
    std::deque<std::pair<double, RegionScale::Radii>> pending;
    int inside_50 = 0, inside_95 = 0;
    for (int i = 0; i < count; ++i) {
        PoseCovariance covariance;
        covariance.position.setIdentity();
        scale.apply(covariance);
        const double s = square(), scaled = s / covariance.position(0, 0);
        inside_50 += scaled <= covariance.radius_50;
        inside_95 += scaled <= covariance.radius_95;
        pending.emplace_back(s, scale.radii());
        if (pending.size() <= 4) continue;
        scale.learn(pending.front().first, pending.front().second);
        pending.pop_front();
    }
    return {inside_50 / double(count), inside_95 / double(count)};
}

TEST(RegionScale, MakesRegionsHoldWhatTheySayOfErrorsOfAnySizeAndShape) {
    RandomStream random(4);
    for (const double sigma : {0.05, 1.0, 30.0})
        for (const bool heavy : {false, true}) {
            const auto square = [&] {
                const double tail =
                    heavy ? std::exp(1.5 * random.normal()) : 1;  // many small, a few very large
                return random.normal_vector(sigma * tail).squaredNorm();
            };
            const auto [inside_50, inside_95] = shares_within(square, 6000);
            // What is promised of recordings. The logarithm of a radius starts up to 7 away from where it belongs, in
            // steps of 0.03 and more or 0.01 to 0.19: 7 / 0.06 / 6000 = 0.02 would be all on one side.
            EXPECT_NEAR(inside_50, 0.5, 0.05) << sigma << heavy;
            EXPECT_NEAR(inside_95, 0.95, 0.02) << sigma << heavy;
        }
}

TEST(RegionScale, StatesTheMeanSquareAsItsCovariance) {
    RandomStream random(5);
    RegionScale scale;
    for (int i = 0; i < 4000; ++i) scale.learn(random.normal_vector(0.3).squaredNorm(), scale.radii());
    PoseCovariance covariance;
    covariance.position.setIdentity();
    scale.apply(covariance);
    // 200 squares of three dimensions: a standard error of sqrt(2 / 3 / 200) = 6 %; three of them.
    EXPECT_NEAR(covariance.position(0, 0), 0.09, 0.18 * 0.09);
}

TEST(Arbitrated, LearnsFromNothingWhatTheFilterCannotKnow) {
    // Strokes between two surfaces: a filter never foresees the turns.
    const auto at = [](int i) {
        const double t = i / 60.0, s = 8 * t + 0.5 * std::sin(1.3 * t);
        return PoseSample{t,
                          Vector3d(0.1 * std::sin(0.7 * s), 0.4 * std::abs(std::sin(s)), 0.2 * std::cos(s))};
    };
    Arbitrated both = arbitrated(model_of_random_weights(48, 3), 100);
    const auto filter = make_predictor(kFilter);
    double of_both = 0, of_filter = 0;
    for (int i = 0; i < 3600; ++i) {
        (void)both.correct(at(i));
        (void)filter->correct(at(i));
        if (i < 2400) continue;
        of_both += (both.predict(4 / 60.0).position - at(i + 4).position).squaredNorm();
        of_filter += (filter->predict(4 / 60.0).position - at(i + 4).position).squaredNorm();
    }
    EXPECT_LT(std::sqrt(of_both), 0.8 * std::sqrt(of_filter)) << "the last third of 60 s: at least 20 % less";
}

TEST(Arbitrated, IsTheFilterToTheBitBeforeErrorsAreKnown) {
    Arbitrated both = arbitrated(lasting_velocity());
    const auto filter = make_predictor(kFilter);
    const auto same = [&](double lead) {
        const PosePrediction a = both.predict(lead), b = filter->predict(lead);
        return a.position == b.position && a.velocity == b.velocity &&
               a.orientation.coeffs() == b.orientation.coeffs();
    };
    for (int i = 0; i < 300; ++i) {
        EXPECT_EQ(both.correct(upwards(i)), filter->correct(upwards(i)));
        // Of 1/60 s ahead 0.25 s of errors are known 16 samples later at the earliest.
        if (i < 16) {
            EXPECT_TRUE(same(0.05)) << i;
        }
        if (i > 60) {
            EXPECT_FALSE(same(0.05)) << "the model is right";
        }
    }
}

TEST(Arbitrated, IsNeverMuchWorseThanTheFilterWhateverTheModelSays) {
    for (int kind = 0; kind < kKinds; ++kind)
        for (std::uint64_t seed = 1; seed <= 12; ++seed) {
            Arbitrated both = arbitrated(model_of_random_weights(16, seed), seed % 2 == 0 ? 0 : 100);
            const auto filter = make_predictor(kFilter);
            const double of_filter = rms_of(*filter, kind, 3000), of_both = rms_of(both, kind, 3000);
            // 1 % is what is promised on recordings.
            EXPECT_LT(of_both, 1.01 * of_filter) << kind << ' ' << seed;
        }
}

TEST(Arbitrated, BecomesTheModelWhereThatIsRight) {
    Arbitrated both = arbitrated(lasting_velocity());
    const auto filter = make_predictor(kFilter);
    for (int i = 0; i < 300; ++i) {
        (void)both.correct(upwards(i));
        (void)filter->correct(upwards(i));
    }
    EXPECT_GT((filter->predict(1.0 / 15).position - upwards(303).position).norm(), 0.01);
    EXPECT_LT((both.predict(1.0 / 15).position - upwards(303).position).norm(), 1e-3);
}

TEST(Arbitrated, KeepsWhatItLearnedOverGapsAndFollowsTheFiltersGate) {
    Arbitrated both = arbitrated(lasting_velocity());
    const auto filter = make_predictor(kFilter);
    for (int i = 0; i < 900; ++i) {
        PoseSample sample = upwards(i);
        if (i >= 400) sample.t_s += 0.3;
        if (i % 97 == 50) sample.position.x() += 3.0;  // an outlier
        const SampleStatus status = filter->correct(sample);
        EXPECT_EQ(both.correct(sample), status);
        EXPECT_EQ(status == SampleStatus::outlier, i % 97 == 50) << i;
        EXPECT_EQ(status == SampleStatus::reinitialised, i == 0 || i == 400) << i;
        EXPECT_EQ(both.time_s(), filter->time_s());
        const auto error = [&](const Predictor& of) {
            return (of.predict(0.1).position - upwards(i + 6).position).norm();
        };
        // As soon as both know a velocity again; from nothing the model is not followed for 0.25 s.
        if ((i >= 402 && i < 415) || (i >= 300 && i < 400 && i % 97 != 50)) {
            EXPECT_LT(error(both), 0.3 * error(*filter)) << i;
        }
        EXPECT_TRUE(both.covariance(0.1)->position.allFinite());
    }
}

TEST(Arbitrated, BeginsWithTheTrustThatAnotherPerformanceEndedWith) {
    PathModel model = lasting_velocity();
    Arbitrated earlier = arbitrated(model);
    for (int i = 0; i < 400; ++i) (void)earlier.correct(upwards(i));
    model.trust.push_back(earlier.trust());
    model.trust[0].stick = "left";

    Arbitrated left = arbitrated(model), right = arbitrated(model);
    begin_with_trust(left, model, "left");
    begin_with_trust(right, model, "right");
    const auto filter = make_predictor(kFilter);
    const auto error = [](const Predictor& of, int i) {
        return (of.predict(0.1).position - upwards(i + 6).position).norm();
    };
    for (int i = 0; i < 15; ++i) {
        for (Predictor* one : std::initializer_list<Predictor*>{&left, &right, filter.get()})
            (void)one->correct(upwards(i));
        if (i < 2) continue;                                      // no velocity is known
        EXPECT_LT(error(left, i), 0.3 * error(*filter, i)) << i;  // as within a performance, after a gap
        EXPECT_EQ(right.predict(0.1).position, filter->predict(0.1).position)
            << "a stick that was not there: the filter for 0.25 s";
    }
}

TEST(Arbitrated, ItsTrustComesBackToTheBitAndItsRegionsWithIt) {
    const PathModel model = lasting_velocity();
    Arbitrated earlier = arbitrated(model);
    for (int i = 0; i < 900; ++i) (void)earlier.correct(motion(0, i));
    const Trust trust = earlier.trust();
    Arbitrated later = arbitrated(model);
    later.begin_with(trust);
    const Trust kept = later.trust();
    EXPECT_EQ(std::memcmp(&kept.leads, &trust.leads, sizeof trust.leads), 0);
    for (std::size_t l = 0; l < kNodes; ++l)
        EXPECT_NE(trust.leads[l].regions.radii.log_50, Trust::Radii().log_50) << l;
    // Regions are stated from the first prediction on as they were learned.
    (void)later.correct(motion(0, 0));
    const PoseCovariance stated = later.covariance(1.0 / 15).value(),
                         learned = earlier.covariance(1.0 / 15).value();
    EXPECT_DOUBLE_EQ(stated.radius_50, learned.radius_50);
    EXPECT_DOUBLE_EQ(stated.radius_95, learned.radius_95);
}

TEST(Arbitrated, ItsVelocityIsTheSlopeOfItsPath) {
    Arbitrated both = arbitrated(lasting_velocity());
    const auto filter = make_predictor(kFilter);
    for (int i = 0; i < 400; ++i) {  // what nobody foresees makes shares that differ between the leads
        PoseSample sample = upwards(i);
        sample.position.x() += 0.001 * std::sin(0.9 * i);
        (void)both.correct(sample);
        (void)filter->correct(sample);
    }
    constexpr double kStep = 1e-6;
    for (const double lead : {0.005, 0.02, 0.05, 0.09, 0.12, 0.149, 0.2}) {
        const Vector3d slope =
            (both.predict(lead + kStep).position - both.predict(lead - kStep).position) / (2 * kStep);
        EXPECT_LT((both.predict(lead).velocity - slope).norm(), 1e-5) << lead;
        EXPECT_GT((both.predict(lead).velocity - filter->predict(lead).velocity).norm(), 1e-3) << lead;
    }
}

}  // namespace
}  // namespace tracking
