#include "filter/rotation_filter.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "tracking/rotation.h"

namespace tracking {
namespace {

constexpr double kHalfTurn = std::numbers::pi;

/// Whether the lanes' length exceeds `limit`.
bool exceeds(const Lanes& lanes, double limit) {
    return !(lanes.matrix().squaredNorm() <= limit * limit);
}

double median(double a, double b, double c) {
    return std::max(std::min(a, b), std::min(std::max(a, b), c));
}

/// `v` turned back by half of the turn q, the shorter way: v - n x v + n x (n x v) / (1 + q_w), n q's vector.
Eigen::Vector3d half_way_back(const Eigen::Quaterniond& q, const Eigen::Vector3d& v) {
    const double sign = q.w() < 0 ? -1 : 1;
    const Eigen::Vector3d n = sign * q.vec();
    const Eigen::Vector3d side = n.cross(v);
    return v - side + n.cross(side) / (1 + sign * q.w());
}

}  // namespace

void RotationFilter::start(const PoseSample& sample) noexcept {
    started_ = false;
    q_ = Eigen::Quaterniond::Identity();
    rates_ = {};
    if (sample.has_orientation) start_at(sample.orientation);
}

void RotationFilter::start_at(const Eigen::Quaterniond& measured) noexcept {
    p_ = model_.initial_covariance();
    gate_.restart();
    started_ = true;
    q_ = measured.normalized();
    last_measured_ = q_;
    since_measured_ = interval_ = interval_before_ = 0;
    turned_ = Eigen::Quaterniond::Identity();
    rates_ = {};
}

void RotationFilter::turn(double dt) noexcept {
    const MotionStep step = model_.step(dt);
    rates_ = step.f * rates_;
    p_ = propagated(p_, step);
    const Eigen::Quaterniond by = exponential(rates_.p.head<3>());
    rates_.p.setZero();
    q_ = by * q_;
    turned_ = since_measured_ > 0 ? by * turned_ : by;
    since_measured_ += dt;
}

void RotationFilter::correct(const Eigen::Quaterniond& measured) noexcept {
    if (!started_) return start_at(measured);
    const Eigen::Quaterniond z = measured.normalized();
    const Eigen::Vector3d innovation = logarithm(z * q_.conjugate());
    if (gate_.is_on()) {
        const Eigen::Vector3d step = logarithm(z * last_measured_.conjugate());
        const OutlierGate::Verdict verdict = gate_.judge_step(step, since_measured_, innovation.squaredNorm(),
                                                              p_.pp + model_.measurement_variance);
        if (verdict == OutlierGate::Verdict::refuse) return;
        if (verdict == OutlierGate::Verdict::persists) return start_at(measured);
    }
    const AxisGain<double> k = tracking::correct(p_, model_.measurement_variance);
    const Lanes back = to_lanes(half_way_back(turned_, innovation));
    rates_.v += k.v * back;
    rates_.a += k.a * back;
    if (is_beyond_half_a_turn()) return start_at(measured);
    q_ = (exponential(k.p * innovation) * q_).normalized();
    last_measured_ = z;
    interval_before_ = interval_;
    interval_ = since_measured_;
    since_measured_ = 0;
}

bool RotationFilter::is_beyond_half_a_turn() const noexcept {
    // Of three intervals the middle one: a drop-out does not count.
    const double first = interval_before_ > 0 ? interval_before_ : since_measured_;
    const double second = interval_ > 0 ? interval_ : since_measured_;
    const double dt = median(since_measured_, first, second);
    return exceeds(rates_.v * dt, kHalfTurn) || exceeds(rates_.a * (dt * dt), kHalfTurn);
}

void RotationFilter::look_ahead(double lead_s, PosePrediction& pose) const noexcept {
    set_rotation(pose, model_.transition(lead_s) * rates_, q_);
}

Motion RotationFilter::motion(const AxisStates& point) const noexcept {
    Motion motion;
    motion.position = point.p.head<3>();
    motion.velocity = point.v.head<3>();
    motion.acceleration = point.a.head<3>();
    motion.orientation = q_;
    motion.turn = rates_.p.head<3>();
    motion.angular_velocity = rates_.v.head<3>();
    motion.angular_acceleration = rates_.a.head<3>();
    std::tie(motion.law, motion.rate) = model_.law();
    return motion;
}

double RotationFilter::variance_after(double lead_s) const noexcept {
    if (!started_) return kHalfTurn * kHalfTurn / 3;
    return lead_s == 0 ? p_.pp : propagated(p_, model_.step(lead_s)).pp;
}

}  // namespace tracking
