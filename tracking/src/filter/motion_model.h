#pragma once
#include <Eigen/Core>
#include <utility>
#include <variant>

#include "filter/axis_state.h"
#include "tracking/motion.h"

namespace tracking {

/// F(dt) and Q(dt).
struct MotionStep {
    Transition f;
    AxisMatrix<double> q;
};

template <typename T>
[[nodiscard]] inline AxisMatrix<T> propagated(const AxisMatrix<T>& p, const MotionStep& step) noexcept {
    return propagated(p, step.f, step.q);
}

inline constexpr double kThird = 1.0 / 3;  // a product costs a fifth of a division

/// A model of one axis' motion in SI units (m, or rad for rotations): state [p, v, a], F(dt) and Q(dt) for
/// any dt, the sensor's variance and the covariance at the start. The axes are alike and independent, so one
/// covariance serves all.
struct MotionModel {
    /// Constant velocity driven by white acceleration noise of density q [m^2/s^3]; the state's acceleration
    /// stays 0.
    struct ConstantVelocity {
        double q;
        [[nodiscard]] AxisMatrix<double> noise(double dt) const noexcept {
            const double q1 = q * dt;
            return {q1 * (dt * dt) * kThird, q1 * (0.5 * dt), 0, q1, 0, 0};
        }
    };
    /// Velocity that decays at rate `decay` [1/s], driven by white acceleration noise of density q
    /// (integrated Ornstein-Uhlenbeck process): what is known of a velocity fades with the lead.
    struct DecayingVelocity {
        double decay, q;
        [[nodiscard]] Transition transition(double dt) const noexcept;
        [[nodiscard]] MotionStep step(double dt) const noexcept;
    };
    /// Constant acceleration driven by white jerk of density q [m^2/s^5].
    struct ConstantAcceleration {
        double q;
        [[nodiscard]] AxisMatrix<double> noise(double dt) const noexcept {
            const double q1 = q * dt, q2 = q1 * dt, q3 = q2 * dt;
            return {q3 * (dt * dt * 0.05), q3 * (0.125 * dt), q3 * (0.5 * kThird), q3 * kThird, 0.5 * q2, q1};
        }
    };
    /// Acceleration that decays at rate alpha [1/s], driven by white noise of density q [m^2/s^5] (Singer
    /// 1970).
    struct Singer {
        double alpha, q;
        [[nodiscard]] Transition transition(double dt) const noexcept;
        [[nodiscard]] MotionStep step(double dt) const noexcept;
    };
    /// Constant acceleration and the same Q at every step, whatever its dt (Friedmann 1992, 3.12 and 3.18).
    struct FixedStep {
        AxisMatrix<double> q;
    };

    std::variant<ConstantVelocity, DecayingVelocity, ConstantAcceleration, Singer, FixedStep> kind;
    double measurement_variance = 0.25e-3 * 0.25e-3;                           ///< R (3.19)
    Eigen::Vector3d initial_variance = Eigen::Vector3d(1e2, 1e6, 1e8) * 1e-6;  ///< of p, v, a

    [[nodiscard]] Transition transition(double dt) const noexcept {
        if (const auto* singer = std::get_if<Singer>(&kind)) return singer->transition(dt);
        if (const auto* decaying = std::get_if<DecayingVelocity>(&kind)) return decaying->transition(dt);
        return {dt, dt * dt / 2, 1, dt, 1};
    }
    /// Both, exact: Q is the integral of F(s) g g^T F(s)^T q over [0, dt], g the place where the noise
    /// enters.
    [[nodiscard]] MotionStep step(double dt) const noexcept;
    /// How the transition goes on, and the rate of its decay [1/s].
    [[nodiscard]] std::pair<MotionLaw, double> law() const noexcept {
        if (const auto* singer = std::get_if<Singer>(&kind))
            return {MotionLaw::decaying_acceleration, singer->alpha};
        if (const auto* decaying = std::get_if<DecayingVelocity>(&kind))
            return {MotionLaw::decaying_velocity, decaying->decay};
        return {MotionLaw::constant, 0};
    }
    [[nodiscard]] AxisMatrix<double> initial_covariance() const noexcept {
        return {initial_variance.x(), 0, 0, initial_variance.y(), 0, initial_variance.z()};
    }
    /// The same model with every length multiplied by `factor`: the same gains in another unit.
    [[nodiscard]] MotionModel scaled(double factor) const;
};

// Here, not in the source file: the filters' inner loop keeps the entries in registers.
inline MotionStep MotionModel::step(double dt) const noexcept {
    if (const auto* singer = std::get_if<Singer>(&kind)) return singer->step(dt);
    if (const auto* decaying = std::get_if<DecayingVelocity>(&kind)) return decaying->step(dt);
    const Transition f{dt, dt * dt / 2, 1, dt, 1};
    if (const auto* acceleration = std::get_if<ConstantAcceleration>(&kind))
        return {f, acceleration->noise(dt)};
    if (const auto* velocity = std::get_if<ConstantVelocity>(&kind)) return {f, velocity->noise(dt)};
    return {f, std::get_if<FixedStep>(&kind)->q};
}

/// The covariances before and after a correction that (3.10) and (3.9) settle to at a constant rate, the
/// solution of the discrete Riccati equation (3.7), and the gain. Iterates until no entry changes by more
/// than 1e-15 of itself, at most 1e6 times.
struct SteadyState {
    AxisMatrix<double> before, covariance;
    AxisGain<double> gain;
};
[[nodiscard]] SteadyState steady_state(const MotionModel& model, double dt);

}  // namespace tracking
