#pragma once
#include <Eigen/Geometry>

#include "filter/motion_model.h"
#include "filter/outlier_gate.h"
#include "filter/pose_of_states.h"
#include "tracking/predictor.h"

namespace tracking {

/// Kalman filter of an orientation (Friedmann 1992, section 3.2): an absolute unit quaternion q outside the
/// filter, and inside it a small rotation rho about it with velocity w and acceleration, all in world axes.
/// rho is 0 between samples.
///
///   propagate  q <- exp(rho) q with [rho, w, a] <- F(dt) [0, w, a]
///   innovate   nu = log(z q^-1), the shorter way round, so the sign of z does not matter
///   correct    q <- exp(K_p nu) q, and w, a += K_v, K_a times nu turned back by half of what q turned
///              since the last measurement
///
/// An error of w in world axes has turned q about axes that turned with it, by half the turn on average: w
/// and a corrected with nu as it is make the filter unstable from 0.55 rad a sample on (33 rad/s at 60 Hz),
/// with half the turn taken back it is stable up to half a turn a sample (eigenvalues of the error's
/// recursion).
///
/// Valid while the turn between two samples is below pi; a state that turns, or changes its rate, by more
/// starts anew from the measurement. The covariance is the axes' own (the noise is alike in all directions,
/// so turning rho's frame leaves it alone). No allocation.
class RotationFilter {
public:
    /// The model of a point's motion, scaled as if the rotation moved the tip of a stick of kLever: the gains
    /// are those of the position. gate_sigmas <= 0: no gate.
    RotationFilter(const MotionModel& position_model, double gate_sigmas)
        : model_(position_model.scaled(1 / kLever)),
          p_(model_.initial_covariance()),
          gate_(OutlierGate::of_rotations(gate_sigmas)) {}

    /// Starts anew from a sample; its orientation, or the first one that follows, is taken as it is.
    void start(const PoseSample& sample) noexcept;
    /// Moves the state on by dt and takes the sample's orientation, if it has one, into account.
    void update(const PoseSample& sample, double dt) noexcept {
        if (started_) turn(dt);
        if (sample.has_orientation) correct(sample.orientation);
    }

    /// The pose a lead ahead of a point whose state is then `ahead`. Without any orientation so far it has
    /// the identity and no turning.
    [[nodiscard]] PosePrediction pose(const AxisStates& ahead, double lead_s) const noexcept {
        PosePrediction pose = pose_of_point(ahead);
        if (started_) look_ahead(lead_s, pose);
        return pose;
    }
    /// What pose() depends on where the point's state is now `point`, under the same model.
    [[nodiscard]] Motion motion(const AxisStates& point) const noexcept;
    /// Variance of the predicted orientation about each axis [rad^2]; pi^2/3 (any angle) before the first
    /// measurement.
    [[nodiscard]] double variance_after(double lead_s) const noexcept;
    [[nodiscard]] bool is_finite() const noexcept { return !started_ || rates_.is_finite(); }

private:
    void correct(const Eigen::Quaterniond& measured) noexcept;
    void start_at(const Eigen::Quaterniond& measured) noexcept;
    void turn(double dt) noexcept;
    void look_ahead(double lead_s, PosePrediction& pose) const noexcept;
    /// Beyond half a turn a sample the rates are aliases of slower ones, which the measurements cannot tell
    /// apart.
    [[nodiscard]] bool is_beyond_half_a_turn() const noexcept;

    MotionModel model_;
    AxisMatrix<double> p_;
    OutlierGate gate_;
    bool started_ = false;
    Eigen::Quaterniond q_ = Eigen::Quaterniond::Identity();
    Eigen::Quaterniond last_measured_ = Eigen::Quaterniond::Identity();
    Eigen::Quaterniond turned_ = Eigen::Quaterniond::Identity();  // since then, by prediction
    double since_measured_ = 0;
    double interval_ = 0, interval_before_ = 0;  // between the last measurements, 0: not yet
    AxisStates rates_;                           // rho (0 between samples), w [rad/s], a [rad/s^2]
};

}  // namespace tracking
