#include "filter/kalman_predictor.h"

namespace tracking {
KalmanPredictor::KalmanPredictor(const MotionModel& model, const KalmanOptions& options)
    : position_(model, options.steady_rate_hz),
      gate_(OutlierGate::of_positions(options.gate_sigmas)),
      rotation_(options.turning.value_or(model), options.gate_sigmas),
      turns_otherwise_(options.turning.has_value()) {}

SampleStatus KalmanPredictor::correct(const PoseSample& sample) noexcept {
    return clock_.take(
        sample, [this](const PoseSample& first) { return start(first); },
        [this](const PoseSample& next) { return update(next); });
}

SampleStatus KalmanPredictor::start(const PoseSample& sample) noexcept {
    clock_.advance(sample.t_s);
    position_.start(sample.position);
    gate_.restart(sample.position);
    rotation_.start(sample);
    return SampleStatus::reinitialised;
}

SampleStatus KalmanPredictor::update(const PoseSample& sample) noexcept {
    const double dt = sample.t_s - clock_.time_s();
    PositionFilter::Estimate ahead = position_.propagate(dt);
    const Lanes innovation = ahead.innovation(sample.position);
    if (gate_.is_on()) {
        const OutlierGate::Verdict verdict = gate_.judge(
            sample.position, dt, innovation.matrix().squaredNorm(), position_.innovation_variance(ahead));
        if (verdict == OutlierGate::Verdict::refuse) return SampleStatus::outlier;
        if (verdict == OutlierGate::Verdict::persists) return start(sample);
    }
    position_.correct(ahead, innovation);
    rotation_.update(sample, dt);
    if (!ahead.x.is_finite() || !rotation_.is_finite()) return start(sample);
    position_.accept(ahead);
    clock_.advance(sample.t_s);
    return SampleStatus::accepted;
}

PosePrediction KalmanPredictor::predict(double lead_s) const noexcept {
    return rotation_.pose(position_.after(lead_s), lead_s);
}

std::optional<PoseCovariance> KalmanPredictor::covariance(double lead_s) const noexcept {
    const AxisMatrix<double> ahead = position_.covariance_after(lead_s);
    return PoseCovariance{ahead.pp * Eigen::Matrix3d::Identity(), ahead.vv * Eigen::Matrix3d::Identity(),
                          rotation_.variance_after(lead_s) * Eigen::Matrix3d::Identity()};
}

}  // namespace tracking
