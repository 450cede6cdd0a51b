#include "tracking/sensor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "tracking/predictor.h"
#include "tracking/rotation.h"

namespace tracking {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

/// A stick that moves along x at 1 m/s (so that positions tell times) and turns at 2 rad/s, at `rate`.
StickTrace steady(double duration, double rate) {
    StickTrace stick{"a", {}};
    for (int k = 0; k <= std::lround(duration * rate); ++k) {
        PoseSample sample;
        sample.t_s = 5 + k / rate;
        sample.position = {k / rate, 1, -0.5};
        sample.orientation = exponential(Vector3d(0.3, 2, 0.1).normalized() * (2 * k / rate));
        sample.has_orientation = true;
        stick.samples.push_back(sample);
    }
    return stick;
}

/// Uneven steps, poses that have nothing to do with each other, two gaps.
StickTrace erratic() {
    std::mt19937 random(11);
    const auto uniform = [&] { return static_cast<double>(random()) * 0x1p-32; };
    StickTrace stick{"a", {}};
    double t = -3;
    for (int k = 0; k < 200; ++k) {
        PoseSample sample;
        sample.t_s = t;
        sample.position = {uniform(), uniform(), uniform()};
        sample.orientation = Quaterniond(uniform() - 0.5, uniform(), uniform(), uniform()).normalized();
        sample.has_orientation = true;
        stick.samples.push_back(sample);
        t += k % 70 == 69 ? 0.15 : 0.001 + 0.02 * uniform();
    }
    return stick;
}

double mean(const std::vector<double>& x) {
    return std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
}

double deviation(const std::vector<double>& x) {
    const double centre = mean(x);
    double sum = 0;
    for (const double v : x) sum += (v - centre) * (v - centre);
    return std::sqrt(sum / static_cast<double>(x.size() - 1));
}

bool same(const std::vector<PoseSample>& a, const std::vector<PoseSample>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const PoseSample& x, const PoseSample& y) {
        return x.t_s == y.t_s && x.position == y.position &&
               x.orientation.coeffs() == y.orientation.coeffs() && x.has_orientation == y.has_orientation;
    });
}

TEST(PoseAt, IsLinearInPositionAndTurnsTheShorterWayAtAConstantRate) {
    const StickTrace stick = erratic();
    for (std::size_t i = 1; i < stick.samples.size(); ++i) {
        const PoseSample &a = stick.samples[i - 1], &b = stick.samples[i];
        if (b.t_s - a.t_s > kGapS) continue;
        for (const double share : {0.0, 0.1, 0.5, 0.93}) {
            const std::optional<PoseSample> pose = pose_at(stick, a.t_s + share * (b.t_s - a.t_s));
            ASSERT_TRUE(pose);
            // Steps of 1 ms or more at times near 3 s: the time's own rounding moves the share by 1e-12.
            EXPECT_LT((pose->position - (1 - share) * a.position - share * b.position).norm(), 1e-11);
            const Quaterniond expected =
                a.orientation * exponential(share * logarithm(a.orientation.conjugate() * b.orientation));
            EXPECT_LT(logarithm(pose->orientation.conjugate() * expected).norm(), 1e-11);
        }
    }
}

TEST(PoseAt, KnowsNothingOutsideTheRecordingNorInsideGaps) {
    const StickTrace stick = erratic();
    const double t0 = stick.samples.front().t_s, t_end = stick.samples.back().t_s;
    EXPECT_FALSE(pose_at(stick, t0 - 1e-9));
    EXPECT_FALSE(pose_at(stick, t_end + 1e-9));
    EXPECT_FALSE(pose_at(stick, std::nan("")));
    EXPECT_TRUE(pose_at(stick, t0) && pose_at(stick, t_end));
    int gaps = 0;
    for (std::size_t i = 1; i < stick.samples.size(); ++i) {
        const double a = stick.samples[i - 1].t_s, b = stick.samples[i].t_s;
        EXPECT_EQ(pose_at(stick, (a + b) / 2).has_value(), b - a <= kGapS);
        EXPECT_TRUE(pose_at(stick, a));
        gaps += b - a > kGapS;
    }
    EXPECT_EQ(gaps, 2);
}

TEST(PoseAt, BothSignsOfAQuaternionGiveTheSamePath) {
    StickTrace stick = erratic();
    const StickTrace before = stick;
    for (std::size_t i = 0; i < stick.samples.size(); i += 3) stick.samples[i].orientation.coeffs() *= -1;
    for (double t = stick.samples.front().t_s; t < stick.samples.back().t_s; t += 0.0007) {
        const std::optional<PoseSample> a = pose_at(before, t), b = pose_at(stick, t);
        ASSERT_EQ(a.has_value(), b.has_value());
        if (!a) continue;
        EXPECT_NEAR(std::abs(a->orientation.dot(b->orientation)), 1, 1e-12);
    }
}

TEST(Sensor, WithoutFaultsReportsTheRecordingItselfOrUniformTimesOnIt) {
    const StickTrace stick = erratic();
    EXPECT_TRUE(same(sense(stick, {}), stick.samples));
    SensorModel sensor;
    sensor.rate_hz = 60;
    const std::vector<PoseSample> seen = sense(stick, sensor);
    std::size_t next = 0;
    for (int k = 0; stick.samples[0].t_s + k / 60.0 <= stick.samples.back().t_s; ++k) {
        const std::optional<PoseSample> pose = pose_at(stick, stick.samples[0].t_s + k / 60.0);
        if (!pose) continue;
        ASSERT_TRUE(next < seen.size() && same({*pose}, {seen[next++]})) << k;
    }
    EXPECT_EQ(next, seen.size());
    EXPECT_LT(seen.size(), 60 * (stick.samples.back().t_s - stick.samples[0].t_s)) << "the gaps stay gaps";
}

TEST(Sensor, NoiseHasItsStandardDeviationOnEachAxisAndIsWhite) {
    const StickTrace stick = steady(60, 240);
    SensorModel sensor;
    sensor.noise_m = 0.002;
    sensor.noise_rad = 0.01;
    const std::vector<PoseSample> seen = sense(stick, sensor);
    ASSERT_EQ(seen.size(), stick.samples.size());
    for (int axis = 0; axis < 3; ++axis) {
        std::vector<double> position, rotation, successive;
        for (std::size_t i = 0; i < seen.size(); ++i) {
            position.push_back(seen[i].position[axis] - stick.samples[i].position[axis]);
            rotation.push_back(
                logarithm(seen[i].orientation * stick.samples[i].orientation.conjugate())[axis]);
            if (i > 0) successive.push_back(position[i] * position[i - 1]);
        }
        // 14401 samples: the deviation's own relative error is 0.6 %, the mean's 0.8 % of sigma; 5 sigma.
        EXPECT_NEAR(deviation(position), 0.002, 0.03 * 0.002);
        EXPECT_NEAR(deviation(rotation), 0.01, 0.03 * 0.01);
        EXPECT_LT(std::abs(mean(position)), 0.042 * 0.002);
        EXPECT_LT(std::abs(mean(successive)), 0.042 * 0.002 * 0.002);
    }
}

TEST(Sensor, JitterHasItsStandardDeviationKeepsTheOrderAndStampsSayWhatTheyPromise) {
    const StickTrace stick = steady(100, 1000);
    SensorModel sensor;
    sensor.rate_hz = 100;
    sensor.jitter_s = 0.001;
    for (const bool true_stamps : {true, false}) {
        sensor.true_stamps = true_stamps;
        const std::vector<PoseSample> seen = sense(stick, sensor);
        ASSERT_EQ(seen.size(), 10001u);
        std::vector<double> shift;
        for (std::size_t k = 1; k + 1 < seen.size(); ++k) {
            const double nominal = 5 + 0.01 * static_cast<double>(k);
            const double taken = 5 + seen[k].position.x();  // 1 m/s
            shift.push_back(taken - nominal);
            EXPECT_NEAR(seen[k].t_s, true_stamps ? taken : nominal, 1e-9);
            EXPECT_GT(seen[k].t_s, seen[k - 1].t_s);
            EXPECT_GT(seen[k].position.x(), seen[k - 1].position.x());
        }
        // 10^4 samples: 0.7 % of sigma; 5 of them. The cut at 4.5 sigma does not show.
        EXPECT_NEAR(deviation(shift), 0.001, 0.035 * 0.001);
    }
    sensor.jitter_s = 0.05;  // five periods: all that the cut leaves
    const std::vector<PoseSample> wild = sense(stick, sensor);
    for (std::size_t k = 1; k < wild.size(); ++k) ASSERT_GT(wild[k].position.x(), wild[k - 1].position.x());
}

TEST(Sensor, DropOutsHaveTheirShareAndTheirMeanBurst) {
    const StickTrace stick = steady(400, 250);
    for (const auto& [share, burst] : {std::pair(0.1, 3.0), std::pair(0.1, 1.0), std::pair(0.5, 8.0)}) {
        SensorModel sensor;
        sensor.drop_out = share;
        sensor.burst = burst;
        const std::vector<PoseSample> seen = sense(stick, sensor);
        const auto sent = static_cast<double>(stick.samples.size());
        std::vector<double> bursts;
        for (std::size_t i = 1; i < seen.size(); ++i) {
            const double lost = std::round((seen[i].t_s - seen[i - 1].t_s) * 250) - 1;
            if (lost > 0) bursts.push_back(lost);
        }
        // 100001 samples in bursts: about 1e5 share / burst independent ones, each of relative deviation
        // below 1; 5 standard errors of the share (2 burst lengths correlate) and of the mean burst.
        const double bound = 5 / std::sqrt(sent * share / burst);
        EXPECT_NEAR(1 - static_cast<double>(seen.size()) / sent, share, 1.5 * bound * share);
        EXPECT_NEAR(mean(bursts), burst, bound * burst);
        if (burst > 1) continue;
        EXPECT_EQ(*std::max_element(bursts.begin(), bursts.end()), 1);
    }
}

TEST(Sensor, LatencyDelaysEveryStampAndLeavesThePoses) {
    const StickTrace stick = erratic();
    SensorModel sensor;
    sensor.latency_s = 0.025;
    const std::vector<PoseSample> seen = sense(stick, sensor);
    ASSERT_EQ(seen.size(), stick.samples.size());
    for (std::size_t i = 0; i < seen.size(); ++i) {
        EXPECT_EQ(seen[i].t_s, stick.samples[i].t_s + 0.025);
        EXPECT_EQ(seen[i].position, stick.samples[i].position);
    }
}

TEST(Sensor, QuantisationRoundsToTheNearestStepAndKeepsTheQuaternionsSign) {
    const StickTrace stick = steady(4, 500);  // turns by 8 rad: over the double cover
    SensorModel sensor;
    sensor.quantum_m = 0.004;
    sensor.quantum_rad = 0.01;
    const std::vector<PoseSample> seen = sense(stick, sensor);
    for (std::size_t i = 0; i < seen.size(); ++i) {
        const Vector3d steps = seen[i].position / 0.004;
        EXPECT_LT((steps - steps.array().round().matrix()).norm(), 1e-9);
        EXPECT_LE((seen[i].position - stick.samples[i].position).cwiseAbs().maxCoeff(), 0.002 + 1e-12);
        const Vector3d turns = logarithm(seen[i].orientation) / 0.01;
        EXPECT_LT((turns - turns.array().round().matrix()).norm(), 1e-9);
        // Half a step on each axis, sqrt(3) of it together; vectors of up to pi shorten it, never stretch.
        EXPECT_LE(logarithm(seen[i].orientation.conjugate() * stick.samples[i].orientation).norm(),
                  0.005 * std::sqrt(3.0) + 1e-12);
        EXPECT_GT(seen[i].orientation.dot(stick.samples[i].orientation), 0.9);
    }
}

TEST(Sensor, OutliersHaveTheirShareAndFillTheirBallEvenly) {
    const StickTrace stick = steady(200, 250);
    SensorModel sensor;
    sensor.outlier = 0.2;
    sensor.outlier_m = 0.5;
    const std::vector<PoseSample> seen = sense(stick, sensor);
    int outliers = 0, inner = 0;
    Vector3d sum = Vector3d::Zero();
    for (std::size_t i = 0; i < seen.size(); ++i) {
        const Vector3d off = seen[i].position - stick.samples[i].position;
        ASSERT_LE(off.norm(), 0.5 + 1e-12);
        if (off.isZero(0)) continue;
        ++outliers;
        inner += off.norm() < 0.5 * std::cbrt(0.5);  // half the ball's volume
        sum += off;
    }
    // 10^4 outliers of 50001: binomial deviations 89 and 50; the mean's 0.5 / sqrt(5) / 100 m an axis; 5 of
    // them.
    EXPECT_NEAR(outliers, 10000, 450);
    EXPECT_NEAR(inner, outliers / 2.0, 250);
    EXPECT_LT((sum / outliers).cwiseAbs().maxCoeff(), 0.012);
}

TEST(Sensor, DuplicatesArriveTwiceAndLateOnesRightAfterTheirSuccessor) {
    const StickTrace stick = steady(100, 250);
    SensorModel sensor;
    sensor.late = 0.1;
    const auto count = static_cast<double>(stick.samples.size());
    std::vector<PoseSample> seen = sense(stick, sensor);
    ASSERT_EQ(seen.size(), stick.samples.size());
    int late = 0;
    for (std::size_t i = 0; i < seen.size(); ++i) {
        if (seen[i].t_s == stick.samples[i].t_s) continue;
        ASSERT_LT(i + 1, seen.size());
        ASSERT_EQ(seen[i].t_s, stick.samples[i + 1].t_s);
        ASSERT_EQ(seen[i + 1].t_s, stick.samples[i].t_s);
        ++late, ++i;
    }
    EXPECT_NEAR(late, 0.1 * count, 5 * std::sqrt(0.1 * count));
    sensor.late = 0;
    sensor.duplicate = 0.3;
    seen = sense(stick, sensor);
    for (std::size_t i = 1; i < seen.size(); ++i) {
        ASSERT_GE(seen[i].t_s, seen[i - 1].t_s);
        ASSERT_TRUE(seen[i].t_s > seen[i - 1].t_s || same({seen[i]}, {seen[i - 1]}));
    }
    EXPECT_NEAR(static_cast<double>(seen.size()), 1.3 * count, 5 * std::sqrt(0.21 * count));
}

TEST(Sensor, TheSameSeedGivesTheSameSamplesOtherSeedsAndSticksOthers) {
    const StickTrace stick = steady(2, 250);
    SensorModel sensor;
    sensor.noise_m = 0.001;
    const std::vector<PoseSample> first = sense(stick, sensor, 0);
    EXPECT_TRUE(same(first, sense(stick, sensor, 0)));
    const std::vector<PoseSample> other_stick = sense(stick, sensor, 1);
    sensor.seed = 2;
    const std::vector<PoseSample> other_seed = sense(stick, sensor, 0);
    for (const std::vector<PoseSample>& other : {other_stick, other_seed}) {
        double products = 0;
        for (std::size_t i = 0; i < first.size(); ++i)
            products += (first[i].position - stick.samples[i].position)
                            .dot(other[i].position - stick.samples[i].position);
        // 1503 products of variance sigma^4: uncorrelated within 5 deviations.
        EXPECT_LT(std::abs(products), 5 * std::sqrt(1503.0) * 1e-6);
        EXPECT_FALSE(same(first, other));
    }
}

TEST(Sensor, SwitchingOneFaultOnLeavesTheDrawsOfTheOthersAlone) {
    const StickTrace stick = steady(4, 250);
    SensorModel sensor;
    sensor.noise_m = 0.001;
    const std::vector<PoseSample> all = sense(stick, sensor);
    sensor.drop_out = 0.3;
    sensor.duplicate = 0.2;
    sensor.outlier = 0.1;
    sensor.noise_rad = 0.01;
    int equal = 0;
    for (const PoseSample& sample : sense(stick, sensor)) {
        const PoseSample& clean = all.at(static_cast<std::size_t>(std::lround((sample.t_s - 5) * 250)));
        equal += sample.position == clean.position;
    }
    EXPECT_GT(equal, 500) << "all but the outliers, of about 840";
}

TEST(Sensor, ParametersOutOfRangeAreRefused) {
    const StickTrace stick = steady(1, 100);
    const auto refused = [&](auto change) {
        SensorModel sensor;
        change(sensor);
        EXPECT_THROW(static_cast<void>(sense(stick, sensor)), std::invalid_argument);
    };
    refused([](SensorModel& s) { s.rate_hz = -1; });
    refused([](SensorModel& s) { s.rate_hz = std::nan(""); });
    refused([](SensorModel& s) { s.jitter_s = -1; });
    refused([](SensorModel& s) { s.drop_out = 0.95; });
    refused([](SensorModel& s) { s.burst = 0.5; });
    refused([](SensorModel& s) { s.drop_out = 0.9; });  // not in bursts of three
    refused([](SensorModel& s) { s.noise_m = std::nan(""); });
    refused([](SensorModel& s) { s.outlier = 1.5; });
    refused([](SensorModel& s) { s.late = 0.6; });
    refused([](SensorModel& s) { s.latency_s = -0.1; });
    StickTrace long_one = stick;
    long_one.samples.back().t_s = 1e7;
    SensorModel fast;
    fast.rate_hz = 1e5;
    EXPECT_THROW(static_cast<void>(sense(long_one, fast)), std::invalid_argument) << "1e12 samples";
}

}  // namespace
}  // namespace tracking
