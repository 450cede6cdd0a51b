#pragma once
#include <Eigen/Core>

#include "motion_model.h"

namespace tracking {

/// Rows p, v, a; a column an axis.
using AxisStates = Eigen::Matrix3d;

/// Covariance and gain of a Kalman filter whose three axes share one model (Friedmann 1992, 3.5-3.10), H = [1
/// 0 0].
///
///   propagate  P <- F(dt) P F(dt)^T + Q(dt)                                    (3.10)
///   gain       K = P H^T / (H P H^T + R)                                       (3.5)
///   correct    P <- (I - K H) P (I - K H)^T + K R K^T                          (3.9)
///
/// Departure: (3.9) in Joseph form, which stays symmetric and positive under rounding. The owner keeps the
/// means: x <- F x, then x <- x + K innovation, whatever an innovation is for it (a difference of positions,
/// or a small rotation). No allocation.
class AxisCovariance {
public:
    explicit AxisCovariance(const MotionModel& model) : model_(model) { restart(); }

    void restart() noexcept { p_ = model_.initial_variance.asDiagonal(); }
    /// Returns F(dt).
    Transition propagate(double dt) noexcept;
    /// Variance of the innovation on an axis, H P H^T + R.
    [[nodiscard]] double innovation_variance() const noexcept {
        return p_(0, 0) + model_.measurement_variance;
    }
    /// Takes a measurement into account; returns its gain K.
    Eigen::Vector3d correct() noexcept;

    [[nodiscard]] const MotionModel& model() const noexcept { return model_; }
    [[nodiscard]] const Eigen::Matrix3d& covariance() const noexcept { return p_; }

private:
    MotionModel model_;
    Eigen::Matrix3d p_;
};

}  // namespace tracking
