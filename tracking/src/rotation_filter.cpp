#include "rotation_filter.h"

#include <cmath>
#include <numbers>

#include "rotation.h"

namespace tracking {
namespace {

constexpr double kHalfTurn = std::numbers::pi;

/// Whether the lanes' length exceeds `limit`.
bool exceeds(const Lanes& lanes, double limit) {
    return !(lanes.matrix().squaredNorm() <= limit * limit);
}

}  // namespace

void RotationFilter::restart() noexcept {
    started_ = false;
    q_ = Eigen::Quaterniond::Identity();
    rates_ = {};
}

void RotationFilter::start(const Eigen::Quaterniond& measured) noexcept {
    p_ = model_.initial_covariance();
    gate_.restart();
    started_ = true;
    q_ = measured.normalized();
    last_measured_ = q_;
    since_measured_ = 0;
    rates_ = {};
}

void RotationFilter::absorb() noexcept {
    q_ = exponential(rates_.p.head<3>()) * q_;
    rates_.p.setZero();
}

void RotationFilter::turn(double dt) noexcept {
    since_measured_ += dt;
    const MotionStep step = model_.step(dt);
    rates_ = step.f * rates_;
    p_ = propagated(p_, step);
    absorb();
}

void RotationFilter::correct(const Eigen::Quaterniond& measured) noexcept {
    if (!started_) return start(measured);
    const Eigen::Quaterniond z = measured.normalized();
    const Eigen::Vector3d innovation = logarithm(z * q_.conjugate());
    if (gate_.is_on()) {
        const Eigen::Vector3d step = logarithm(z * last_measured_.conjugate());
        switch (gate_.judge_step(step, since_measured_, innovation.squaredNorm(),
                                 p_.pp + model_.measurement_variance)) {
            case OutlierGate::Verdict::refuse:
                return;
            case OutlierGate::Verdict::persists:
                return start(measured);
            case OutlierGate::Verdict::pass:
                break;
        }
    }
    add(rates_, tracking::correct(p_, model_.measurement_variance), to_lanes(innovation));
    // Beyond half a turn a sample the rates are aliases of slower ones, which the measurements cannot tell
    // apart.
    const double dt = since_measured_;
    if (exceeds(rates_.v * dt, kHalfTurn) || exceeds(rates_.a * (dt * dt), kHalfTurn)) return start(measured);
    absorb();
    q_.normalize();
    last_measured_ = z;
    since_measured_ = 0;
}

void RotationFilter::turned(double lead_s, PosePrediction& pose) const noexcept {
    const AxisStates ahead = model_.transition(lead_s) * rates_;
    pose.orientation = (exponential(ahead.p.head<3>()) * q_).normalized();
    pose.angular_velocity = ahead.v.head<3>();
}

double RotationFilter::variance_after(double lead_s) const noexcept {
    if (!started_) return kHalfTurn * kHalfTurn / 3;
    return lead_s == 0 ? p_.pp : propagated(p_, model_.step(lead_s)).pp;
}

}  // namespace tracking
