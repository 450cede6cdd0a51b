#pragma once
#include <Eigen/Geometry>

#include "axis_covariance.h"
#include "outlier_gate.h"

namespace tracking {

/// Kalman filter of an orientation (Friedmann 1992, section 3.2): an absolute unit quaternion q outside the
/// filter, and inside it a small rotation rho about it with velocity w and acceleration, all in world axes.
/// rho is 0 between samples.
///
///   propagate  q <- exp(rho) q with [rho, w, a] <- F(dt) [0, w, a]
///   innovate   log(z q^-1), the shorter way round, so the sign of z does not matter
///   correct    [rho, w, a] += K innovation, then q <- exp(rho) q and rho = 0
///
/// Valid while the turn between two samples is small against pi; a state that turns, or changes its rate, by
/// more starts anew from the measurement. The covariance is the axes' own (the noise is alike in all
/// directions, so turning rho's frame leaves it alone). No allocation.
class RotationFilter {
public:
    RotationFilter(const MotionModel& model, const OutlierGate& gate) : covariance_(model), gate_(gate) {}

    void restart() noexcept;
    /// Moves the state on by dt.
    void propagate(double dt) noexcept;
    /// Takes a measured orientation; the first one after restart() is taken as it is.
    void correct(const Eigen::Quaterniond& measured) noexcept;

    [[nodiscard]] Eigen::Quaterniond orientation_after(double lead_s) const noexcept;
    [[nodiscard]] Eigen::Vector3d velocity_after(double lead_s) const noexcept;
    [[nodiscard]] bool is_finite() const noexcept { return q_.coeffs().allFinite() && rates_.allFinite(); }

private:
    void start(const Eigen::Quaterniond& measured) noexcept;

    AxisCovariance covariance_;
    OutlierGate gate_;
    bool started_ = false;
    Eigen::Quaterniond q_ = Eigen::Quaterniond::Identity();
    Eigen::Quaterniond last_measured_ = Eigen::Quaterniond::Identity();
    double since_measured_ = 0;
    AxisStates rates_ = AxisStates::Zero();  // rows: rho (always 0 here), w [rad/s], a [rad/s^2]
};

}  // namespace tracking
