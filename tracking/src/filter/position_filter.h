#pragma once
#include <optional>

#include "filter/motion_model.h"
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
    struct Estimate {
        AxisStates x;
        AxisMatrix<double> p;

        /// From the estimated position to a measured one [m].
        [[nodiscard]] Lanes innovation(const Eigen::Vector3d& measured) const noexcept {
            return to_lanes(measured) - x.p;
        }
    };

    /// steady_rate_hz 0: the gain follows P.
    explicit PositionFilter(const MotionModel& model, double steady_rate_hz = 0);

    void start(const Eigen::Vector3d& position) noexcept;
    /// The estimate moved on by dt; leaves the filter alone.
    [[nodiscard]] Estimate propagate(double dt) const noexcept {
        if (steady_) return {model_.transition(dt) * now_.x, steady_->before};
        const MotionStep step = model_.step(dt);
        return {step.f * now_.x, propagated(now_.p, step)};
    }
    /// Takes a measurement into account that lies `innovation` from a propagated estimate.
    void correct(Estimate& estimate, const Lanes& innovation) const noexcept {
        if (steady_) {
            add(estimate.x, steady_->gain, innovation);
            estimate.p = steady_->covariance;
        } else {
            add(estimate.x, tracking::correct(estimate.p, model_.measurement_variance), innovation);
        }
    }
    void accept(const Estimate& estimate) noexcept { now_ = estimate; }
    /// Variance of the innovation on an axis, H P H^T + R [m^2].
    [[nodiscard]] double innovation_variance(const Estimate& estimate) const noexcept {
        return estimate.p.pp + model_.measurement_variance;
    }

    [[nodiscard]] AxisStates after(double lead_s) const noexcept {
        return model_.transition(lead_s) * now_.x;
    }
    [[nodiscard]] AxisMatrix<double> covariance_after(double lead_s) const noexcept {
        if (lead_s == 0) return now_.p;  // a noise that is the same at any step has none at no step
        return propagated(now_.p, model_.step(lead_s));
    }
    [[nodiscard]] const Estimate& now() const noexcept { return now_; }
    [[nodiscard]] const MotionModel& model() const noexcept { return model_; }

private:
    MotionModel model_;
    Estimate now_;
    std::optional<SteadyState> steady_;
};

}  // namespace tracking
