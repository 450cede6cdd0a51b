#pragma once
#include <optional>

#include "motion_model.h"
#include "tracking/predictor.h"

namespace tracking {

/// Kalman filter of a point with a given model of motion, without a clock (Friedmann 1992, 3.3-3.10).
///
///   x  9    position [m], velocity, acceleration of the three axes; P 3x3 is shared by the axes, which have
///           the same model, rate and noise
///   propagate  x <- F(dt) x, P <- F P F^T + Q(dt)     (3.4, 3.10)
///   correct    x <- x + K (z - H x), P by Joseph's form (3.3, 3.5, 3.9)
///   after      F(lead) x
///
/// With a steady rate the gain is that of the Riccati equation (3.7) at this rate from the first sample on,
/// and P stays what it is there; F(dt) keeps the true dt. No allocation.
class PositionFilter {
public:
    /// steady_rate_hz 0: the gain follows P.
    explicit PositionFilter(const MotionModel& model, double steady_rate_hz = 0);

    void start(const Eigen::Vector3d& position) noexcept;
    void propagate(double dt) noexcept;
    /// From the position that propagate() predicted to a measured one [m].
    [[nodiscard]] Lanes innovation(const Eigen::Vector3d& measured) const noexcept {
        return to_lanes(measured) - x_.p;
    }
    /// Variance of the innovation on an axis, H P H^T + R [m^2].
    [[nodiscard]] double innovation_variance() const noexcept { return p_.pp + model_.measurement_variance; }
    void correct(const Lanes& innovation) noexcept;

    [[nodiscard]] AxisStates after(double lead_s) const noexcept { return model_.transition(lead_s) * x_; }
    [[nodiscard]] AxisMatrix<double> covariance_after(double lead_s) const noexcept {
        return propagated(p_, model_.transition(lead_s), model_.process_noise(lead_s));
    }
    [[nodiscard]] const AxisStates& state() const noexcept { return x_; }
    [[nodiscard]] const AxisMatrix<double>& covariance() const noexcept { return p_; }
    [[nodiscard]] const MotionModel& model() const noexcept { return model_; }

private:
    MotionModel model_;
    std::optional<SteadyState> steady_;
    AxisStates x_;
    AxisMatrix<double> p_;
};

}  // namespace tracking
