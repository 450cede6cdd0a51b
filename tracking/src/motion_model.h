#pragma once
#include <Eigen/Core>
#include <variant>

namespace tracking {

/// F(dt) of the state [position, velocity, acceleration] of one axis.
using Transition = Eigen::Matrix3d;

/// A model of one axis' motion in SI units (m, or rad for rotations): state [p, v, a], F(dt) and Q(dt) for
/// any dt, the sensor's variance and the covariance at the start. The axes are alike and independent, so one
/// 3x3 covariance serves all.
struct MotionModel {
    /// Constant velocity driven by white acceleration noise of density q [m^2/s^3]; the state's acceleration
    /// stays 0.
    struct ConstantVelocity {
        double q;
    };
    /// Constant acceleration driven by white jerk of density q [m^2/s^5].
    struct ConstantAcceleration {
        double q;
    };
    /// Acceleration that decays at rate alpha [1/s], driven by white noise of density q [m^2/s^5] (Singer
    /// 1970).
    struct Singer {
        double alpha, q;
    };
    /// Constant acceleration and the same Q at every step, whatever its dt (Friedmann 1992, 3.12 and 3.18).
    struct FixedStep {
        Eigen::Matrix3d q;
    };

    std::variant<ConstantVelocity, ConstantAcceleration, Singer, FixedStep> kind;
    double measurement_variance = 0.25e-3 * 0.25e-3;                           ///< R (3.19)
    Eigen::Vector3d initial_variance = Eigen::Vector3d(1e2, 1e6, 1e8) * 1e-6;  ///< of p, v, a

    [[nodiscard]] Transition transition(double dt) const noexcept;
    [[nodiscard]] Eigen::Matrix3d process_noise(double dt) const noexcept;
    /// The same model with every length multiplied by `factor`: the same gains in another unit.
    [[nodiscard]] MotionModel scaled(double factor) const;
};

}  // namespace tracking
