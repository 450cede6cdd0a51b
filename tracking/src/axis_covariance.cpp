#include "axis_covariance.h"

namespace tracking {

Transition AxisCovariance::propagate(double dt) noexcept {
    const Transition f = model_.transition(dt);
    const Eigen::Matrix3d fp = f * p_;
    p_.noalias() = fp * f.transpose();
    p_ += model_.process_noise(dt);
    return f;
}

Eigen::Vector3d AxisCovariance::correct() noexcept {
    const Eigen::Vector3d k = p_.col(0) / innovation_variance();
    Eigen::Matrix3d keep = Eigen::Matrix3d::Identity();
    keep.col(0) -= k;
    const Eigen::Matrix3d kept = keep * p_;
    p_.noalias() = kept * keep.transpose();
    p_ += model_.measurement_variance * (k * k.transpose());
    p_ = (0.5 * (p_ + p_.transpose())).eval();
    return k;
}

}  // namespace tracking
