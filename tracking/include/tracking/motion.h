#pragma once
#include <Eigen/Geometry>
#include <cstdint>

namespace tracking {

/// The pose expected a lead after the newest sample. World frame, SI.
struct PosePrediction {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< d position / d lead [m/s]
    Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
    Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< world frame [rad/s]
};

/// How velocity and acceleration go on: constant acceleration; velocity that decays at `rate` (acceleration
/// 0); acceleration that decays at `rate` (Singer 1970).
enum class MotionLaw : std::uint64_t { constant, decaying_velocity, decaying_acceleration };

/// All that an estimator's predictions depend on, as a value that can be copied bit by bit between processes:
/// the state at the newest sample and how it goes on. World frame, SI.
///
///   [position, velocity, acceleration], [turn, angular velocity, angular acceleration] <- F(lead) per axis
///   orientation <- exp(turn) orientation
struct Motion {
    Eigen::Vector3d position = Eigen::Vector3d::Zero(), velocity = Eigen::Vector3d::Zero(),
                    acceleration = Eigen::Vector3d::Zero();
    Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
    Eigen::Vector3d
        turn = Eigen::Vector3d::Zero(),  ///< from `orientation`, a rotation vector [rad]; 0 for filters
        angular_velocity = Eigen::Vector3d::Zero(), angular_acceleration = Eigen::Vector3d::Zero();
    MotionLaw law = MotionLaw::constant;
    double rate = 0;  ///< of the decay [1/s]

    /// The pose `lead_s` >= 0 later: to the bit what the estimator's predict(lead_s) gives where that is a
    /// Kalman filter, within 1e-12 m and rad where it is another.
    [[nodiscard]] PosePrediction after(double lead_s) const noexcept;
};

/// Motion at constant velocities from a pose on.
[[nodiscard]] Motion steady_motion(const PosePrediction& from) noexcept;

}  // namespace tracking
