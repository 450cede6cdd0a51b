#pragma once
#include "axis_covariance.h"
#include "outlier_gate.h"
#include "rotation_filter.h"
#include "sample_clock.h"
#include "tracking/predictor.h"

namespace tracking {

/// Kalman filter of a pose with a given model of motion (Friedmann 1992, 3.1-3.19 and section 3.2).
///
///   x  3x3  rows position [m], velocity, acceleration; a column an axis, world frame; P shared by the axes
///   a sample at dt after the state: x <- F(dt) x, P <- F P F^T + Q(dt), then x <- x + K (z - H x)
///   a prediction at lead L:         F(L) x, its velocity the second row
///
/// The rotation runs the same model (RotationFilter), scaled as if it moved the tip of a stick of kLever: its
/// gains are those of the position. predict() extrapolates it with F(L) too. A state that is not finite after
/// a sample starts anew from it. No allocation.
class KalmanPredictor : public Predictor {
public:
    /// gate_sigmas <= 0: no gate. Otherwise impossible samples (OutlierGate: 25 m/s, 3000 m/s^2) answer
    /// `outlier`.
    KalmanPredictor(const MotionModel& model, double gate_sigmas);

    [[nodiscard]] SampleStatus correct(const PoseSample& sample) noexcept override;
    [[nodiscard]] PosePrediction predict(double lead_s) const noexcept override;
    [[nodiscard]] double time_s() const noexcept override { return clock_.time_s(); }

private:
    SampleStatus start(const PoseSample& sample) noexcept;
    SampleStatus update(const PoseSample& sample) noexcept;
    [[nodiscard]] OutlierGate::Verdict judge(const PoseSample& sample, double dt,
                                             const AxisStates& x) noexcept;

    SampleClock clock_;
    AxisCovariance covariance_;
    OutlierGate gate_;
    RotationFilter rotation_;
    AxisStates x_ = AxisStates::Zero();
    Eigen::Vector3d last_measured_ = Eigen::Vector3d::Zero();
};

}  // namespace tracking
