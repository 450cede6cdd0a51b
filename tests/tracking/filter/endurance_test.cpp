// Filters over very many uneven samples of a bad sensor.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <random>

#include "filter/interacting_models.h"
#include "filter/kalman_predictor.h"
#include "filter/model_bank.h"

namespace tracking {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Least eigenvalue of the correlations, over the state's first `size` components: at least 0, but for
/// rounding.
double least_correlation(const Matrix3d& p, int size) {
    const auto block = p.topLeftCorner(size, size);
    if (!p.allFinite() || !(block.diagonal().array() > 0).all()) return -1;
    const Eigen::VectorXd scale = block.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd correlation = scale.asDiagonal() * block * scale.asDiagonal();
    return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(correlation, Eigen::EigenvaluesOnly)
        .eigenvalues()(0);
}

Matrix3d on_axis(const AxisMatrix<Lanes>& p, int i) {
    Matrix3d m;
    m << p.pp[i], p.pv[i], p.pa[i], p.pv[i], p.vv[i], p.va[i], p.pa[i], p.va[i], p.aa[i];
    return m;
}

/// Of all covariances of [p, v, a] inside a predictor.
double least_correlation_inside(const Predictor& predictor) {
    double least = 1;
    const auto take = [&](const PositionFilter& filter) {
        const Matrix3d p = filter.now().p.matrix();
        const bool has_acceleration = filter.model().initial_variance.z() > 0;
        least = std::min(least, least_correlation(p, has_acceleration ? 3 : 2));
    };
    if (const auto* kalman = dynamic_cast<const KalmanPredictor*>(&predictor)) take(kalman->position());
    if (const auto* bank = dynamic_cast<const ModelBank*>(&predictor))
        for (std::size_t i = 0; i < ModelBank::kModels; ++i) take(bank->position(i));
    if (const auto* imm = dynamic_cast<const InteractingModels*>(&predictor))
        for (std::size_t j = 0; j < InteractingModels::kModes; ++j)
            for (int axis = 0; axis < 3; ++axis)
                least = std::min(least, least_correlation(on_axis(imm->mode(j).p, axis), 3));
    return least;
}

bool is_symmetric_and_positive(const Matrix3d& m) {
    return m == m.transpose() && m.allFinite() && least_correlation(m, 3) > 0;
}

/// A bad sensor: steps from 1e-5 to 1 s (over 0.1 s the filter starts anew), drop-outs, duplicates, late
/// samples, single and persisting outliers, NaN.
class BadSensor {
public:
    PoseSample next() {
        t_ += std::pow(10, -5 + 5 * uniform());
        if (random_() % 10 == 0) t_ += std::pow(10, -5 + 4 * uniform());
        PoseSample sample;
        sample.t_s = t_;
        sample.position = {0.3 * std::sin(9 * t_), 1 + 0.2 * std::sin(14 * t_), 0.1 * uniform()};
        sample.orientation = Eigen::AngleAxisd(3 * std::sin(2 * t_), Vector3d(1, 2, 2) / 3);
        sample.has_orientation = random_() % 20 != 0;
        switch (random_() % 100) {
            case 0:
            case 1:
                sample.position += 5 * Vector3d(uniform() - 0.5, uniform() - 0.5, uniform() - 0.5);
                break;
            case 2:
                sample.position.x() = std::numeric_limits<double>::quiet_NaN();
                break;
            case 3:
                sample.t_s -= 0.01 * uniform();
                break;
            default:
                break;
        }
        return sample;
    }
    bool repeats() { return random_() % 50 == 0; }

private:
    double uniform() { return static_cast<double>(random_()) * 0x1p-32; }
    std::mt19937 random_{17};
    double t_ = 0;
};

struct Count {
    std::int64_t samples = 0, accepted = 0, restarts = 0, outliers = 0, refused = 0;
    double least = 1;

    void add(SampleStatus status) {
        ++samples;
        accepted += status == SampleStatus::accepted;
        restarts += status == SampleStatus::reinitialised;
        outliers += status == SampleStatus::outlier;
        refused += status == SampleStatus::not_newer || status == SampleStatus::not_finite;
    }
};

::testing::AssertionResult survives(const std::string& specification, std::int64_t samples, Count& count) {
    const auto predictor = make_predictor(specification);
    BadSensor sensor;
    for (std::int64_t i = 0; i < samples; ++i) {
        const PoseSample sample = sensor.next();
        count.add(predictor->correct(sample));
        if (sensor.repeats() && predictor->correct(sample) == SampleStatus::accepted)
            return ::testing::AssertionFailure() << "took a sample twice";
        if (i % 97 != 0 && i > 1000) continue;
        count.least = std::min(count.least, least_correlation_inside(*predictor));
        for (const double lead : {0.0, 1.0 / 15}) {
            const PosePrediction ahead = predictor->predict(lead);
            const PoseCovariance p = *predictor->covariance(lead);
            if (!ahead.position.allFinite() || !ahead.velocity.allFinite() ||
                !ahead.angular_velocity.allFinite() || !(std::abs(ahead.orientation.norm() - 1) < 1e-12))
                return ::testing::AssertionFailure() << "prediction after sample " << i;
            for (const Matrix3d& m : {p.position, p.velocity, p.rotation})
                if (!is_symmetric_and_positive(m))
                    return ::testing::AssertionFailure() << "covariance after sample " << i << "\n" << m;
        }
        // Rounding of P_aa s - P_pa^2, a few parts in 1e16 of each product.
        if (count.least < -1e-14)
            return ::testing::AssertionFailure() << "after sample " << i << ": " << count.least;
    }
    return ::testing::AssertionSuccess();
}

class Endurance : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Filters, Endurance,
                         testing::Values("ca:", "cv:", "singer:", "bank:", "imm:", "cv:decay=10,"));

/// 2e5 samples a filter; MUSICWORLD_LONG asks for 3.5e7, of which six in ten are updates: 1e8 for the first
/// five.
TEST_P(Endurance, StaysFiniteAndPositiveWhateverTheSensorDoesAndIsSaidToBe) {
    const double in_all = std::getenv("MUSICWORLD_LONG") == nullptr ? 2e5 : 3.5e7;
    const auto begin = std::chrono::steady_clock::now();
    Count count;
    constexpr const char* kNoises[] = {"1e-6", "1e-4", "0.01", "0.25", "30", "1e3"};
    for (const char* r : kNoises)
        for (const char* gate : {"", ",gate=5"})
            EXPECT_TRUE(survives(GetParam() + (std::string("r=") + r) + gate,
                                 static_cast<std::int64_t>(in_all / 12), count))
                << GetParam() << " r=" << r << gate;
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
    std::printf(
        "%-13s %.3g samples in %.1f s: %.3g updates, %.2g restarts, %.2g outliers, %.2g refused; least "
        "eigenvalue of correlations %.2g\n",
        GetParam(), static_cast<double>(count.samples), wall.count(), static_cast<double>(count.accepted),
        static_cast<double>(count.restarts), static_cast<double>(count.outliers),
        static_cast<double>(count.refused), count.least);
    EXPECT_GT(count.restarts, count.samples / 10);
    EXPECT_GT(count.outliers, count.samples / 1000);
}

}  // namespace
}  // namespace tracking
