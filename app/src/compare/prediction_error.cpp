#include "compare/prediction_error.h"

#include <Eigen/Cholesky>
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

}  // namespace

void ErrorScore::add(const tracking::PosePrediction& predicted, const Truth& truth,
                     const Eigen::Vector3d& tip_body) {
    const Eigen::Vector3d error = predicted.position - truth.pose.position;
    const double square_mm2 = kMm2 * error.squaredNorm();
    position.add(square_mm2);
    errors_mm.push_back(std::sqrt(square_mm2));
    if (truth.free) free.add(square_mm2);
    if (truth.unflagged) unflagged.add(square_mm2);
    if (!truth.rotation_trusted) return;
    const double angle = kDegrees * predicted.orientation.angularDistance(truth.pose.orientation);
    const Eigen::Vector3d tip_error =
        error + predicted.orientation * tip_body - truth.pose.orientation * tip_body;
    rotation.add(angle * angle);
    tip.add(kMm2 * tip_error.squaredNorm());
}

void ErrorScore::add(const ErrorScore& other) {
    for (SquareSum ErrorScore::*sum : {&ErrorScore::position, &ErrorScore::free, &ErrorScore::unflagged,
                                       &ErrorScore::rotation, &ErrorScore::tip})
        (this->*sum).add(other.*sum);
    errors_mm.insert(errors_mm.end(), other.errors_mm.begin(), other.errors_mm.end());
}

void LeadScore::add(const tracking::PosePrediction& predicted, const Truth& truth,
                    const Eigen::Vector3d& tip_body,
                    const std::optional<tracking::PoseCovariance>& covariance) {
    error.add(predicted, truth, tip_body);
    if (!covariance) return;
    ++sums.count;
    const Eigen::LLT<Eigen::Matrix3d> factor(covariance->position);
    if (factor.info() != Eigen::Success) {
        ++sums.singular;
        return;
    }
    const Eigen::Vector3d whitened = factor.matrixL().solve(predicted.position - truth.pose.position);
    const double square = whitened.squaredNorm();
    const double log_root = factor.matrixLLT().diagonal().array().log().sum();  // log sqrt(det)
    sums.inside_50 += square <= kRadius50;
    sums.inside_95 += square <= kRadius95;
    sums.negative_log_likelihood += 0.5 * square + log_root + 1.5 * std::log(2 * std::numbers::pi);
}

std::optional<Calibration> LeadScore::calibration() const {
    const std::size_t stated = sums.count - sums.singular;
    if (stated == 0) return std::nullopt;
    Calibration mean = sums;
    for (double* sum : {&mean.inside_50, &mean.inside_95, &mean.negative_log_likelihood})
        *sum /= static_cast<double>(stated);
    return mean;
}

void add(std::optional<Calibration>& sum, const std::optional<Calibration>& other) {
    if (!other) return;
    if (!sum) {
        sum = other;
        return;
    }
    const double a = static_cast<double>(sum->count - sum->singular);
    const double b = static_cast<double>(other->count - other->singular);
    for (double Calibration::*mean :
         {&Calibration::inside_50, &Calibration::inside_95, &Calibration::negative_log_likelihood})
        *sum.*mean = (a * (*sum.*mean) + b * (*other.*mean)) / (a + b);
    sum->count += other->count;
    sum->singular += other->singular;
}

std::vector<LeadScore> score_predictor(const SensedStick& stick, tracking::Predictor& predictor) {
    std::vector<LeadScore> scores(stick.leads_s.size());
    replay_truths(stick, stick.samples, predictor, [&](std::size_t lead, double ahead_s, const Truth& truth) {
        scores[lead].add(predictor.predict(ahead_s), truth, stick.tip, predictor.covariance(ahead_s));
    });
    return scores;
}

std::vector<SquareSum> score_positions(const SensedStick& stick, tracking::Predictor& predictor) {
    std::vector<SquareSum> sums(stick.leads_s.size());
    std::vector<tracking::PoseSample> positions = stick.samples;
    for (tracking::PoseSample& sample : positions) sample = {sample.t_s, sample.position};
    replay_truths(stick, positions, predictor, [&](std::size_t lead, double ahead_s, const Truth& truth) {
        const Eigen::Vector3d error = predictor.predict(ahead_s).position - truth.pose.position;
        sums[lead].add(kMm2 * error.squaredNorm());
    });
    return sums;
}

}  // namespace app
