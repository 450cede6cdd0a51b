#include "compare/prediction_error.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "statistics/statistics.h"
#include "sticks/predictors.h"

namespace app {
namespace {

constexpr double kMm2 = 1e6, kDegrees = 180 / std::numbers::pi;
/// Squared radii of the 50 and 95 % regions of a normal error in three dimensions (chi-square, 3 degrees of
/// freedom).
constexpr double kRadius50 = 2.3659738843753377, kRadius95 = 7.814727903251179;

double root_mean(double sum, std::size_t count) {
    return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : kNoValue;
}

/// Feeds samples of a stick and calls score(lead, ahead_s, truth) for each truth: predict(ahead_s) is held
/// against it.
template <class Score>
void replay_truths(const SensedStick& stick, std::span<const tracking::PoseSample> samples,
                   tracking::Predictor& predictor, const Score& score) {
    replay(predictor, samples, [&](const ReplayedSample& now) {
        for (std::size_t lead = 0; lead < stick.leads_s.size(); ++lead)
            if (const std::optional<Truth>& truth = stick.truth(now.index, lead))
                score(lead, stick.leads_s[lead] + now.behind_s, *truth);
    });
}

std::vector<tracking::PoseSample> positions_of(std::span<const tracking::PoseSample> samples) {
    std::vector<tracking::PoseSample> positions(samples.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
        positions[i].t_s = samples[i].t_s;
        positions[i].position = samples[i].position;
    }
    return positions;
}

}  // namespace

void ErrorGatherer::add(const tracking::PosePrediction& predicted, const Truth& truth,
                        const Eigen::Vector3d& tip,
                        const std::optional<tracking::PoseCovariance>& covariance) {
    const Eigen::Vector3d error = predicted.position - truth.pose.position;
    const double square_mm2 = kMm2 * error.squaredNorm();
    ++score_.count;
    score_.sum_square_mm2 += square_mm2;
    score_.errors_mm.push_back(std::sqrt(square_mm2));
    if (truth.free) score_.free_sum_mm2 += square_mm2, ++score_.free_count;
    if (truth.unflagged) score_.unflagged_sum_mm2 += square_mm2, ++score_.unflagged_count;
    if (truth.rotation_trusted) {
        const double angle = kDegrees * predicted.orientation.angularDistance(truth.pose.orientation);
        const Eigen::Vector3d tip_error = error + predicted.orientation * tip - truth.pose.orientation * tip;
        score_.rotation_sum_deg2 += angle * angle;
        score_.tip_sum_mm2 += kMm2 * tip_error.squaredNorm();
        ++score_.rotation_count;
    }
    if (covariance) add_covariance(error, covariance->position);
}

void ErrorGatherer::add_covariance(const Eigen::Vector3d& error, const Eigen::Matrix3d& covariance) {
    ++calibration_.count;
    const Eigen::LLT<Eigen::Matrix3d> factor(covariance);
    if (factor.info() != Eigen::Success) {
        ++calibration_.singular;
        return;
    }
    const Eigen::Vector3d whitened = factor.matrixL().solve(error);
    const double square = whitened.squaredNorm();
    const double log_root = factor.matrixLLT().diagonal().array().log().sum();  // log sqrt(det)
    calibration_.inside_50 += square <= kRadius50;
    calibration_.inside_95 += square <= kRadius95;
    calibration_.negative_log_likelihood += 0.5 * square + log_root + 1.5 * std::log(2 * std::numbers::pi);
}

ErrorScore ErrorGatherer::error() const {
    ErrorScore total;
    app::add(total, score_);
    return total;
}

std::optional<Calibration> ErrorGatherer::calibration() const {
    const std::size_t stated = calibration_.count - calibration_.singular;
    if (stated == 0) return std::nullopt;
    Calibration mean = calibration_;
    for (double* sum : {&mean.inside_50, &mean.inside_95, &mean.negative_log_likelihood})
        *sum /= static_cast<double>(stated);
    return mean;
}

void add(ErrorScore& sum, const ErrorScore& other) {
    sum.count += other.count;
    sum.sum_square_mm2 += other.sum_square_mm2;
    sum.free_count += other.free_count;
    sum.free_sum_mm2 += other.free_sum_mm2;
    sum.unflagged_count += other.unflagged_count;
    sum.unflagged_sum_mm2 += other.unflagged_sum_mm2;
    sum.rotation_count += other.rotation_count;
    sum.rotation_sum_deg2 += other.rotation_sum_deg2;
    sum.tip_sum_mm2 += other.tip_sum_mm2;
    sum.errors_mm.insert(sum.errors_mm.end(), other.errors_mm.begin(), other.errors_mm.end());
    sum.rms_mm = root_mean(sum.sum_square_mm2, sum.count);
    sum.p95_mm = quantile(sum.errors_mm, 0.95);
    sum.free_rms_mm = root_mean(sum.free_sum_mm2, sum.free_count);
    sum.unflagged_rms_mm = root_mean(sum.unflagged_sum_mm2, sum.unflagged_count);
    sum.rotation_rms_deg = root_mean(sum.rotation_sum_deg2, sum.rotation_count);
    sum.tip_rms_mm = root_mean(sum.tip_sum_mm2, sum.rotation_count);
}

void add(std::optional<Calibration>& sum, const std::optional<Calibration>& other) {
    if (!other) return;
    if (!sum) {
        sum = other;
        return;
    }
    const double a = static_cast<double>(sum->count - sum->singular);
    const double b = static_cast<double>(other->count - other->singular);
    const auto mean = [&](double of_a, double of_b) { return (a * of_a + b * of_b) / (a + b); };
    sum->inside_50 = mean(sum->inside_50, other->inside_50);
    sum->inside_95 = mean(sum->inside_95, other->inside_95);
    sum->negative_log_likelihood = mean(sum->negative_log_likelihood, other->negative_log_likelihood);
    sum->count += other->count;
    sum->singular += other->singular;
}

std::vector<LeadScore> score_predictor(const SensedStick& stick, tracking::Predictor& predictor) {
    std::vector<ErrorGatherer> gatherers(stick.leads_s.size());
    replay_truths(stick, stick.samples, predictor, [&](std::size_t lead, double ahead_s, const Truth& truth) {
        gatherers[lead].add(predictor.predict(ahead_s), truth, stick.tip, predictor.covariance(ahead_s));
    });
    std::vector<LeadScore> scores;
    for (const ErrorGatherer& gatherer : gatherers)
        scores.push_back({gatherer.error(), gatherer.calibration()});
    return scores;
}

double SquareSum::rms_mm() const {
    return count > 0 ? root_mean(sum_mm2, count) : 0;
}

std::vector<SquareSum> score_positions(const SensedStick& stick, tracking::Predictor& predictor) {
    std::vector<SquareSum> sums(stick.leads_s.size());
    const std::vector<tracking::PoseSample> positions = positions_of(stick.samples);
    replay_truths(stick, positions, predictor, [&](std::size_t lead, double ahead_s, const Truth& truth) {
        const Eigen::Vector3d error = predictor.predict(ahead_s).position - truth.pose.position;
        sums[lead].add({kMm2 * error.squaredNorm(), 1});
    });
    return sums;
}

}  // namespace app
