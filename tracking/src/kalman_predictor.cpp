#include "kalman_predictor.h"

#include <cmath>

namespace tracking {
namespace {

constexpr double kLever = 0.4;        // m, a stick's length: turns rad into metres at the tip
constexpr double kFastest = 25;       // m/s, of a tracked hand or tip
constexpr double kStrongest = 3000;   // m/s^2, apart from contacts
constexpr double kFastestTurn = 120;  // rad/s, with room to spare for a wrist

}  // namespace

KalmanPredictor::KalmanPredictor(const MotionModel& model, double gate_sigmas)
    : covariance_(model),
      gate_(gate_sigmas, kFastest, kStrongest),
      rotation_(model.scaled(1 / kLever), OutlierGate(gate_sigmas, kFastestTurn, kStrongest / kLever)) {}

SampleStatus KalmanPredictor::correct(const PoseSample& sample) noexcept {
    const SampleStatus status = clock_.judge(sample);
    if (status == SampleStatus::accepted) return update(sample);
    return status == SampleStatus::reinitialised ? start(sample) : status;
}

SampleStatus KalmanPredictor::start(const PoseSample& sample) noexcept {
    clock_.advance(sample.t_s);
    covariance_.restart();
    gate_.restart();
    rotation_.restart();
    x_.setZero();
    x_.row(0) = sample.position.transpose();
    last_measured_ = sample.position;
    if (sample.has_orientation) rotation_.correct(sample.orientation);
    return SampleStatus::reinitialised;
}

OutlierGate::Verdict KalmanPredictor::judge(const PoseSample& sample, double dt,
                                            const AxisStates& x) noexcept {
    const double innovation = (sample.position.transpose() - x.row(0)).norm();
    return gate_.judge(sample.position - last_measured_, dt, innovation,
                       std::sqrt(covariance_.innovation_variance()));
}

SampleStatus KalmanPredictor::update(const PoseSample& sample) noexcept {
    const double dt = sample.t_s - clock_.time_s();
    const AxisCovariance before = covariance_;
    const AxisStates predicted = covariance_.propagate(dt) * x_;
    switch (judge(sample, dt, predicted)) {
        case OutlierGate::Verdict::refuse:
            covariance_ = before;
            return SampleStatus::outlier;
        case OutlierGate::Verdict::persists:
            return start(sample);
        case OutlierGate::Verdict::pass:
            break;
    }
    const Eigen::RowVector3d innovation = sample.position.transpose() - predicted.row(0);
    x_ = predicted + covariance_.correct() * innovation;
    rotation_.propagate(dt);
    if (sample.has_orientation) rotation_.correct(sample.orientation);
    if (!x_.allFinite() || !rotation_.is_finite()) return start(sample);
    clock_.advance(sample.t_s);
    last_measured_ = sample.position;
    return SampleStatus::accepted;
}

PosePrediction KalmanPredictor::predict(double lead_s) const noexcept {
    const AxisStates ahead = covariance_.model().transition(lead_s) * x_;
    return {ahead.row(0).transpose(), ahead.row(1).transpose(), rotation_.orientation_after(lead_s),
            rotation_.velocity_after(lead_s)};
}

}  // namespace tracking
