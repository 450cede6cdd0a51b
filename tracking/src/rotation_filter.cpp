#include "rotation_filter.h"

#include <cmath>
#include <numbers>

#include "rotation.h"

namespace tracking {
namespace {

constexpr double kHalfTurn = std::numbers::pi;

}  // namespace

void RotationFilter::restart() noexcept {
    started_ = false;
    q_ = Eigen::Quaterniond::Identity();
    rates_.setZero();
}

void RotationFilter::start(const Eigen::Quaterniond& measured) noexcept {
    covariance_.restart();
    gate_.restart();
    started_ = true;
    q_ = measured.normalized();
    last_measured_ = q_;
    since_measured_ = 0;
    rates_.setZero();
}

void RotationFilter::propagate(double dt) noexcept {
    if (!started_) return;
    since_measured_ += dt;
    rates_ = (covariance_.propagate(dt) * rates_).eval();
    q_ = exponential(rates_.row(0).transpose()) * q_;
    rates_.row(0).setZero();
}

void RotationFilter::correct(const Eigen::Quaterniond& measured) noexcept {
    if (!started_) return start(measured);
    const Eigen::Quaterniond z = measured.normalized();
    const Eigen::Vector3d innovation = logarithm(z * q_.conjugate());
    const Eigen::Vector3d step = logarithm(z * last_measured_.conjugate());
    const double sigma = std::sqrt(covariance_.innovation_variance());
    switch (gate_.judge(step, since_measured_, innovation.norm(), sigma)) {
        case OutlierGate::Verdict::refuse:
            return;
        case OutlierGate::Verdict::persists:
            return start(measured);
        case OutlierGate::Verdict::pass:
            break;
    }
    rates_ += covariance_.correct() * innovation.transpose();
    // Beyond half a turn a sample the rates are aliases of slower ones, which the measurements cannot tell
    // apart.
    const double dt = since_measured_;
    if (rates_.row(1).norm() * dt > kHalfTurn || rates_.row(2).norm() * dt * dt > kHalfTurn)
        return start(measured);
    q_ = (exponential(rates_.row(0).transpose()) * q_).normalized();
    rates_.row(0).setZero();
    last_measured_ = z;
    since_measured_ = 0;
}

Eigen::Quaterniond RotationFilter::orientation_after(double lead_s) const noexcept {
    const Eigen::RowVector3d rho = covariance_.model().transition(lead_s).row(0) * rates_;
    return (exponential(rho.transpose()) * q_).normalized();
}

Eigen::Vector3d RotationFilter::velocity_after(double lead_s) const noexcept {
    const Eigen::RowVector3d w = covariance_.model().transition(lead_s).row(1) * rates_;
    return w.transpose();
}

}  // namespace tracking
