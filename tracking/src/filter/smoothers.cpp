#include "filter/smoothers.h"

#include <numbers>

#include "filter/outlier_gate.h"
#include "tracking/rotation.h"

namespace tracking {
namespace {

/// Share of a new value in an exponential smoothing of cut-off f (Casiez et al. 2012, equation 3).
double share_at_cutoff(double f, double dt) {
    return 1 / (1 + 1 / (2 * std::numbers::pi * f * dt));
}

/// From one orientation a share of the way to another.
Eigen::Quaterniond part_way(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to, double share) {
    return (exponential(share * logarithm(to * from.conjugate())) * from).normalized();
}

}  // namespace

SampleStatus DoubleExponential::correct(const PoseSample& sample) noexcept {
    const SampleStatus status = clock_.judge(sample);
    if (status == SampleStatus::reinitialised) {
        dt_ = 0;
        p1_ = p2_ = sample.position;
        q1_ = q2_ = sample.has_orientation ? sample.orientation.normalized() : Eigen::Quaterniond::Identity();
    } else if (status == SampleStatus::accepted) {
        dt_ = sample.t_s - clock_.time_s();
        p1_ += a_ * (sample.position - p1_);
        p2_ += a_ * (p1_ - p2_);
        if (sample.has_orientation) q1_ = part_way(q1_, sample.orientation.normalized(), a_);
        q2_ = part_way(q2_, q1_, a_);
    } else {
        return status;
    }
    clock_.advance(sample.t_s);
    return status;
}

PosePrediction DoubleExponential::predict(double lead_s) const noexcept {
    PosePrediction pose;
    const double slope = dt_ > 0 ? a_ / ((1 - a_) * dt_) : 0;  // of s1 - s2 over time
    pose.velocity = slope * (p1_ - p2_);
    pose.position = p1_ + (p1_ - p2_) + lead_s * pose.velocity;
    const Eigen::Vector3d turn = logarithm(q1_ * q2_.conjugate());
    pose.angular_velocity = slope * turn;
    pose.orientation = (exponential(turn + lead_s * pose.angular_velocity) * q1_).normalized();
    return pose;
}

std::optional<Motion> DoubleExponential::motion() const noexcept {
    Motion motion = steady_motion(predict(0));
    motion.orientation = q1_;  // from there, as predict() turns
    motion.turn = logarithm(q1_ * q2_.conjugate());
    return motion;
}

double OneEuro::share_at_speed(double speed_mps, double dt) const noexcept {
    return share_at_cutoff(options_.least_cutoff_hz + options_.beta_hz_s_per_m * speed_mps, dt);
}

SampleStatus OneEuro::correct(const PoseSample& sample) noexcept {
    const SampleStatus status = clock_.judge(sample);
    if (status != SampleStatus::accepted && status != SampleStatus::reinitialised) return status;
    const bool first = status == SampleStatus::reinitialised;
    const double dt = sample.t_s - clock_.time_s();
    clock_.advance(sample.t_s);
    const Eigen::Quaterniond known = first ? Eigen::Quaterniond::Identity() : last_orientation_;
    const Eigen::Quaterniond orientation = sample.has_orientation ? sample.orientation.normalized() : known;
    if (first) {
        smoothed_ = {sample.position, Eigen::Vector3d::Zero(), orientation, Eigen::Vector3d::Zero()};
    } else {
        PosePrediction& x = smoothed_;
        const double share = share_at_cutoff(options_.derivative_cutoff_hz, dt);
        x.velocity += share * ((sample.position - last_position_) / dt - x.velocity);
        x.position += share_at_speed(x.velocity.norm(), dt) * (sample.position - x.position);
        const Eigen::Vector3d turn = logarithm(orientation * last_orientation_.conjugate());
        x.angular_velocity += share * (turn / dt - x.angular_velocity);
        x.orientation =
            part_way(x.orientation, orientation, share_at_speed(kLever * x.angular_velocity.norm(), dt));
    }
    last_position_ = sample.position;
    last_orientation_ = orientation;
    return status;
}

PosePrediction OneEuro::predict(double lead_s) const noexcept {
    PosePrediction pose = smoothed_;
    pose.position += lead_s * pose.velocity;
    pose.orientation = (exponential(lead_s * pose.angular_velocity) * pose.orientation).normalized();
    return pose;
}

}  // namespace tracking
