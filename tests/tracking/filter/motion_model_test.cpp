#include "filter/motion_model.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <cstdlib>
#include <random>

namespace tracking {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Steady covariance before a measurement, from the discrete Riccati equation solved by structure-preserving
/// doubling.
Matrix3d riccati_by_doubling(const Matrix3d& f, const Matrix3d& q, double r) {
    Matrix3d a = f.transpose();
    Matrix3d g = Vector3d::UnitX() * Vector3d::UnitX().transpose() / r;
    Matrix3d h = q;
    for (int i = 0; i < 40; ++i) {
        const Matrix3d w = (Matrix3d::Identity() + g * h).inverse();
        const Matrix3d next_g = g + a * w * g * a.transpose();
        const Matrix3d next_h = h + a.transpose() * h * w * a;
        a = (a * w * a).eval();
        g = next_g;
        h = next_h;
    }
    return h;
}

TEST(MotionModel, AfterThousandStepsTheGainSolvesTheRiccatiEquation) {
    const Vector3d xi(1e-3, 20e-3, 63e-3);
    for (const MotionModel& model :
         {MotionModel{MotionModel::FixedStep{{xi.x() * xi.x(), 0, 0, xi.y() * xi.y(), 0, xi.z() * xi.z()}}},
          MotionModel{MotionModel::ConstantAcceleration{1e3}}, MotionModel{MotionModel::Singer{3, 1e4}}}) {
        constexpr double kStep = 1.0 / 120;
        AxisMatrix<double> covariance = model.initial_covariance();
        AxisGain<double> last{};
        for (int i = 0; i < 1000; ++i) {
            covariance = propagated(covariance, model.transition(kStep), model.step(kStep).q);
            last = correct(covariance, model.measurement_variance);
        }
        const SteadyState steady = steady_state(model, kStep);
        const Matrix3d p = riccati_by_doubling(model.transition(kStep).matrix(), model.step(kStep).q.matrix(),
                                               model.measurement_variance);
        const Vector3d expected = p.col(0) / (p(0, 0) + model.measurement_variance);
        // Gains range over 1 to 1e4 (position to acceleration), so compare each with itself; both ways round
        // to about 1e-12.
        for (const AxisGain<double>& k : {last, steady.gain})
            EXPECT_LT((Vector3d(k.p, k.v, k.a).cwiseQuotient(expected) - Vector3d::Ones()).norm(), 1e-9);
    }
}

TEST(MotionModel, SingerMatchesItsClosedFormAtAlphaDtOfTwoAndTwenty) {
    for (const double u : {2.0, 20.0}) {
        const double alpha = 40;
        const double dt = u / alpha;
        const double e = std::exp(-u);
        const MotionModel model{MotionModel::Singer{alpha, 1}};
        Matrix3d q;  // Singer 1970, (18), for white noise of density 1
        q(0, 0) = (1 - e * e + 2 * u + 2 * u * u * u / 3 - 2 * u * u - 4 * u * e) / (2 * std::pow(alpha, 5));
        q(0, 1) = q(1, 0) = (e * e + 1 - 2 * e + 2 * u * e - 2 * u + u * u) / (2 * std::pow(alpha, 4));
        q(0, 2) = q(2, 0) = (1 - e * e - 2 * u * e) / (2 * std::pow(alpha, 3));
        q(1, 1) = (4 * e - 3 - e * e + 2 * u) / (2 * std::pow(alpha, 3));
        q(1, 2) = q(2, 1) = (e * e + 1 - 2 * e) / (2 * alpha * alpha);
        q(2, 2) = (1 - e * e) / (2 * alpha);
        // This form cancels about three digits at u = 2.
        EXPECT_LT((model.step(dt).q.matrix() - q).cwiseQuotient(q).cwiseAbs().maxCoeff(), 1e-12);
        EXPECT_NEAR(model.transition(dt).pa * alpha * alpha / (u - 1 + e), 1, 1e-15);  // four roundings
    }
}

TEST(MotionModel, SlowSingerTendsToConstantAcceleration) {
    const MotionModel singer{MotionModel::Singer{1e-3, 2}};
    const MotionModel ca{MotionModel::ConstantAcceleration{2}};
    // The difference is of first order in alpha dt = 1e-5.
    EXPECT_LT((singer.step(0.01).q.matrix() - ca.step(0.01).q.matrix())
                  .cwiseQuotient(ca.step(0.01).q.matrix())
                  .cwiseAbs()
                  .maxCoeff(),
              2e-5);
    EXPECT_LT((singer.transition(0.01).matrix() - ca.transition(0.01).matrix()).cwiseAbs().maxCoeff(), 2e-5);
}

TEST(MotionModel, SlowlyDecayingVelocityTendsToConstantVelocity) {
    const MotionStep decaying = MotionModel{MotionModel::DecayingVelocity{1e-3, 2}}.step(0.01);
    const MotionStep lasting = MotionModel{MotionModel::ConstantVelocity{2}}.step(0.01);
    // The difference is of first order in decay dt = 1e-5.
    EXPECT_NEAR(decaying.f.pv / lasting.f.pv, 1, 1e-5);
    EXPECT_NEAR(decaying.f.vv, 1, 2e-5);
    EXPECT_NEAR(decaying.q.pp / lasting.q.pp, 1, 2e-5);
    EXPECT_NEAR(decaying.q.pv / lasting.q.pv, 1, 2e-5);
    EXPECT_NEAR(decaying.q.vv / lasting.q.vv, 1, 2e-5);
}

TEST(MotionModel, DecayingVelocityHasTheVarianceOfTheOrnsteinUhlenbeckProcess) {
    constexpr double kDecay = 8, kDensity = 3, kTime = 0.2;
    const MotionStep step = MotionModel{MotionModel::DecayingVelocity{kDecay, kDensity}}.step(kTime);
    const double e = std::exp(-kDecay * kTime);
    // Uhlenbeck and Ornstein 1930, for white noise of density q: variances of velocity and displacement.
    EXPECT_NEAR(step.q.vv, kDensity * (1 - e * e) / (2 * kDecay), 1e-15);
    EXPECT_NEAR(step.q.pp, kDensity / (kDecay * kDecay * kDecay) * (kDecay * kTime - 1.5 + 2 * e - e * e / 2),
                1e-15);
    EXPECT_NEAR(step.f.pv, (1 - e) / kDecay, 1e-16);
}

TEST(MotionModel, NoiseOfTwoStepsIsTheNoiseOfOneLongStep) {
    for (const MotionModel& model :
         {MotionModel{MotionModel::ConstantVelocity{3}}, MotionModel{MotionModel::ConstantAcceleration{3}},
          MotionModel{MotionModel::DecayingVelocity{7, 3}}, MotionModel{MotionModel::Singer{7, 3}},
          MotionModel{MotionModel::Singer{500, 3}}}) {
        const Matrix3d f = model.transition(0.03).matrix();
        const Matrix3d two = f * model.step(0.02).q.matrix() * f.transpose() + model.step(0.03).q.matrix();
        const Matrix3d one = model.step(0.05).q.matrix();
        EXPECT_LT((two - one).norm(), 1e-14 * one.norm());
    }
}

/// The integral of response * response^T over [0, dt] by Gauss-Legendre quadrature with 8 nodes on pieces of
/// alpha * length <= 0.25, where its error is below the rounding.
Matrix3d singer_noise_by_quadrature(double alpha, double dt) {
    constexpr double kNode[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267,
                                 0.9602898564975363};
    constexpr double kWeight[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745,
                                   0.1012285362903763};
    const int pieces = 1 + static_cast<int>(4 * alpha * dt);
    const double half = dt / (2 * pieces);
    const MotionModel model{MotionModel::Singer{alpha, 1}};
    Matrix3d sum = Matrix3d::Zero();
    for (int piece = 0; piece < pieces; ++piece)
        for (int node = 0; node < 4; ++node)
            for (const double side : {-1.0, 1.0}) {
                const Transition f = model.transition((2 * piece + 1 + side * kNode[node]) * half);
                const Vector3d r(f.pa, f.va, f.aa);
                sum += kWeight[node] * half * (r * r.transpose());
            }
    return sum;
}

TEST(MotionModel, SingerNoiseIsItsIntegralFromAlphaDtOf1e5thTo50) {
    for (double u = 1e-5; u < 50; u *= 1.7) {
        constexpr double kAlpha = 30;
        const Matrix3d exact = singer_noise_by_quadrature(kAlpha, u / kAlpha);
        const Matrix3d noise = MotionModel{MotionModel::Singer{kAlpha, 1}}.step(u / kAlpha).q.matrix();
        // Just above the series' limit of 0.25 the closed form cancels four digits.
        EXPECT_LT((noise - exact).cwiseQuotient(exact).cwiseAbs().maxCoeff(), 1e-11) << "alpha dt = " << u;
    }
}

TEST(MotionModel, SingerNoiseAndTransitionDoNotJumpWhereTheirFormulasChange) {
    for (const double u : {0.1, 0.25}) {
        const MotionModel model{MotionModel::Singer{1, 1}};
        const double above = std::nextafter(u, 1.0);
        const Matrix3d step = model.step(above).q.matrix() - model.step(u).q.matrix();
        EXPECT_LT(step.cwiseQuotient(model.step(u).q.matrix()).cwiseAbs().maxCoeff(), 1e-11);
        EXPECT_NEAR(model.transition(above).pa / model.transition(u).pa, 1, 1e-13);
    }
}

/// Whether a symmetric matrix has no negative eigenvalue beyond rounding, judged on its correlations.
bool is_positive(const AxisMatrix<double>& p, int size) {
    const Vector3d diagonal(p.pp, p.vv, p.aa);
    if (!(diagonal.head(size).array() > 0).all()) return false;
    const Vector3d scale = diagonal.cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
    const Matrix3d correlation = scale.asDiagonal() * p.matrix() * scale.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(correlation.topLeftCorner(size, size));
    return solver.eigenvalues().minCoeff() > -1e-14;
}

/// One filter's covariance over steps from 1e-5 to 1 s, measurements left out at random, R from `least` to
/// `most` mm^2 that changes between stretches.
::testing::AssertionResult stays_positive(const MotionModel& of, int size, std::int64_t updates) {
    std::mt19937 random(11);
    MotionModel model = of;
    AxisMatrix<double> p = model.initial_covariance();
    for (std::int64_t i = 0; i < updates; ++i) {
        if (i % 1000 == 0)
            model.measurement_variance = 1e-6 * std::pow(10, -12 + 18.0 * (random() % 1001) / 1000);
        const double dt = std::pow(10, -5 + 5.0 * (random() % 1001) / 1000);
        p = propagated(p, model.transition(dt), model.step(dt).q);
        if (random() % 10 != 0) (void)correct(p, model.measurement_variance);
        if ((i % 97 == 0 || i < 10000) && !is_positive(p, size))
            return ::testing::AssertionFailure() << "after update " << i << ":\n" << p.matrix();
    }
    return ::testing::AssertionSuccess();
}

/// A million; MUSICWORLD_LONG asks for 1e8.
std::int64_t update_count() {
    return std::getenv("MUSICWORLD_LONG") == nullptr ? 1'000'000 : 100'000'000;
}

TEST(AxisMatrix, ConstantAccelerationStaysPositiveOverUnevenUpdates) {
    EXPECT_TRUE(stays_positive(MotionModel{MotionModel::ConstantAcceleration{1e3}}, 3, update_count()));
}

TEST(AxisMatrix, ConstantVelocityStaysPositiveOverUnevenUpdates) {
    MotionModel model{MotionModel::ConstantVelocity{1e2}};
    model.initial_variance.z() = 0;
    EXPECT_TRUE(stays_positive(model, 2, update_count()));
}

TEST(AxisMatrix, SingerStaysPositiveOverUnevenUpdates) {
    EXPECT_TRUE(stays_positive(MotionModel{MotionModel::Singer{3, 1e4}}, 3, update_count()));
    EXPECT_TRUE(stays_positive(MotionModel{MotionModel::Singer{30, 1e5}}, 3, update_count() / 10));
}

}  // namespace
}  // namespace tracking
