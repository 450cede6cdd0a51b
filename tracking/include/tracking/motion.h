#pragma once
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <variant>

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

/// The pose `past_s` after a, on the way to b, which is `step_s` > 0 after a: position and velocity on the
/// cubic Hermite piece, orientation by slerp (at a constant rate, the shorter way), angular velocity linear.
[[nodiscard]] PosePrediction pose_between(const PosePrediction& a, const PosePrediction& b, double step_s,
                                          double past_s) noexcept;
/// The pose `past_s` after a, at a's velocities.
[[nodiscard]] PosePrediction pose_beyond(const PosePrediction& a, double past_s) noexcept;

/// The poses expected at equal steps of the lead, for estimators whose predictions no Motion can say: at these
/// leads to the bit what the estimator predicts, between them pose_between(), beyond them pose_beyond(). Plain
/// numbers.
class SampledMotion {
public:
    static constexpr std::size_t kMostPieces = 9;

    SampledMotion() = default;
    /// Leads from 0 to `reach_s` in `pieces` equal steps, at most kMostPieces; the poses are still to be set.
    SampledMotion(double reach_s, std::size_t pieces) noexcept : reach_s_(reach_s), pieces_(pieces) {}

    [[nodiscard]] std::size_t pieces() const noexcept { return pieces_; }
    /// reach i / pieces [s], for i = 0 to pieces().
    [[nodiscard]] double lead_s(std::size_t i) const noexcept {
        return reach_s_ * static_cast<double>(i) / static_cast<double>(pieces_);
    }
    void set(std::size_t i, const PosePrediction& pose) noexcept;
    [[nodiscard]] PosePrediction pose(std::size_t i) const noexcept;
    [[nodiscard]] PosePrediction after(double lead_s) const noexcept;

private:
    double reach_s_ = 0;
    std::uint64_t pieces_ = 1;
    std::array<std::array<double, 13>, kMostPieces + 1> poses_{};  ///< p, v, q (x y z w), angular velocity
};

/// What an estimator expects after its newest sample, as a value.
class PosePath {
public:
    PosePath() = default;
    PosePath(const Motion& motion) : of_(motion) {}         // NOLINT(google-explicit-constructor)
    PosePath(const SampledMotion& motion) : of_(motion) {}  // NOLINT(google-explicit-constructor)

    /// The pose `lead_s` >= 0 after the newest sample.
    [[nodiscard]] PosePrediction after(double lead_s) const noexcept {
        if (const auto* motion = std::get_if<Motion>(&of_)) return motion->after(lead_s);
        return std::get_if<SampledMotion>(&of_)->after(lead_s);
    }
    /// None where the path is one of samples.
    [[nodiscard]] const Motion* motion() const noexcept { return std::get_if<Motion>(&of_); }

private:
    std::variant<Motion, SampledMotion> of_;
};

}  // namespace tracking
