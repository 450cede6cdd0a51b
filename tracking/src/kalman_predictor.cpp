#include "kalman_predictor.h"

#include <cmath>

#include "rotation.h"

namespace tracking {
namespace {

constexpr double kFastest = 25;       // m/s, of a tracked hand or tip
constexpr double kStrongest = 3000;   // m/s^2, apart from contacts
constexpr double kFastestTurn = 120;  // rad/s, with room to spare for a wrist

}  // namespace

OutlierGate position_gate(double sigmas) noexcept {
    return {sigmas, kFastest, kStrongest};
}

OutlierGate rotation_gate(double sigmas) noexcept {
    return {sigmas, kFastestTurn, kStrongest / kLever};
}

KalmanPredictor::KalmanPredictor(const MotionModel& model, const KalmanOptions& options)
    : position_(model, options.steady_rate_hz),
      gate_(position_gate(options.gate_sigmas)),
      rotation_(model.scaled(1 / kLever), rotation_gate(options.gate_sigmas)) {}

SampleStatus KalmanPredictor::correct(const PoseSample& sample) noexcept {
    const SampleStatus status = clock_.judge(sample);
    if (status == SampleStatus::accepted) return update(sample);
    return status == SampleStatus::reinitialised ? start(sample) : status;
}

SampleStatus KalmanPredictor::start(const PoseSample& sample) noexcept {
    clock_.advance(sample.t_s);
    position_.start(sample.position);
    gate_.restart(sample.position);
    rotation_.restart();
    if (sample.has_orientation) rotation_.correct(sample.orientation);
    return SampleStatus::reinitialised;
}

SampleStatus KalmanPredictor::update(const PoseSample& sample) noexcept {
    const double dt = sample.t_s - clock_.time_s();
    PositionFilter::Estimate ahead = position_.propagate(dt);
    const Lanes innovation = ahead.innovation(sample.position);
    if (gate_.is_on()) {
        switch (gate_.judge(sample.position, dt, innovation.matrix().squaredNorm(),
                            position_.innovation_variance(ahead))) {
            case OutlierGate::Verdict::refuse:
                return SampleStatus::outlier;
            case OutlierGate::Verdict::persists:
                return start(sample);
            case OutlierGate::Verdict::pass:
                break;
        }
    }
    position_.correct(ahead, innovation);
    rotation_.propagate(dt);
    if (sample.has_orientation) rotation_.correct(sample.orientation);
    if (!ahead.x.is_finite() || !rotation_.is_finite()) return start(sample);
    position_.accept(ahead);
    clock_.advance(sample.t_s);
    return SampleStatus::accepted;
}

PosePrediction KalmanPredictor::predict(double lead_s) const noexcept {
    const AxisStates ahead = position_.after(lead_s);
    PosePrediction pose;
    pose.position = ahead.p.head<3>();
    pose.velocity = ahead.v.head<3>();
    rotation_.predict(lead_s, pose);
    return pose;
}

std::optional<PoseCovariance> KalmanPredictor::covariance(double lead_s) const noexcept {
    const AxisMatrix<double> ahead = position_.covariance_after(lead_s);
    return PoseCovariance{ahead.pp * Eigen::Matrix3d::Identity(), ahead.vv * Eigen::Matrix3d::Identity(),
                          rotation_.variance_after(lead_s) * Eigen::Matrix3d::Identity()};
}

}  // namespace tracking
