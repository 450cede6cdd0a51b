#pragma once
#include "filter/outlier_gate.h"
#include "filter/position_filter.h"
#include "filter/rotation_filter.h"
#include "filter/sample_clock.h"
#include "tracking/predictor.h"

namespace tracking {

/// Settings of a Kalman predictor beyond its model of motion.
struct KalmanOptions {
    double gate_sigmas = 0;  ///< <= 0: no gate. Otherwise impossible samples (OutlierGate) answer `outlier`
    double steady_rate_hz = 0;  ///< > 0: the steady gain of this rate (PositionFilter)
    /// Model of the rotation, as the motion of a point at the tip (kLever); none: the position's model.
    std::optional<MotionModel> turning = std::nullopt;
};

/// Kalman filter of a pose with a given model of motion (Friedmann 1992, 3.1-3.19 and section 3.2): a
/// PositionFilter and a RotationFilter.
///
/// The rotation runs the same model, scaled as if it moved the tip of a stick of kLever: its gains are those
/// of the position. A state that is not finite after a sample starts anew from it. No allocation. Cost with
/// position only: benchmark `kalman_*`.
class KalmanPredictor final : public Predictor {
public:
    KalmanPredictor(const MotionModel& model, const KalmanOptions& options);

    [[nodiscard]] SampleStatus correct(const PoseSample& sample) noexcept override;
    [[nodiscard]] PosePrediction predict(double lead_s) const noexcept override;
    [[nodiscard]] double time_s() const noexcept override { return clock_.time_s(); }
    [[nodiscard]] std::optional<PoseCovariance> covariance(double lead_s) const noexcept override;
    [[nodiscard]] std::optional<Motion> motion() const noexcept override {
        if (turns_otherwise_) return std::nullopt;  // a Motion has one law
        return rotation_.motion(position_.now().x);
    }

    [[nodiscard]] const PositionFilter& position() const noexcept { return position_; }

private:
    SampleStatus start(const PoseSample& sample) noexcept;
    SampleStatus update(const PoseSample& sample) noexcept;

    SampleClock clock_;
    PositionFilter position_;
    OutlierGate gate_;
    RotationFilter rotation_;
    bool turns_otherwise_;
};

}  // namespace tracking
