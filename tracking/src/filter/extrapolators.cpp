#include "filter/extrapolators.h"

#include "tracking/rotation.h"

namespace tracking {
namespace {

/// The sample's orientation, or `otherwise` if it has none.
Eigen::Quaterniond orientation_of(const PoseSample& sample, const Eigen::Quaterniond& otherwise) {
    return sample.has_orientation ? sample.orientation.normalized() : otherwise;
}

PosePrediction at_rest(const PoseSample& sample) {
    PosePrediction pose;
    pose.position = sample.position;
    pose.orientation = orientation_of(sample, Eigen::Quaterniond::Identity());
    return pose;
}

}  // namespace

PosePrediction ConstantRates::after(double lead_s) const noexcept {
    PosePrediction pose = now;
    pose.position += lead_s * now.velocity;
    pose.orientation = (exponential(lead_s * now.angular_velocity) * now.orientation).normalized();
    return pose;
}

void ConstantRates::step_to(const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation,
                            double dt) noexcept {
    now.velocity = (position - now.position) / dt;
    now.angular_velocity = logarithm(orientation * now.orientation.conjugate()) / dt;
    now.position = position;
    now.orientation = orientation;
}

SampleStatus Hold::correct(const PoseSample& sample) noexcept {
    const SampleStatus status = clock_.judge(sample);
    if (status != SampleStatus::accepted && status != SampleStatus::reinitialised) return status;
    const bool fresh = status == SampleStatus::reinitialised;
    pose_.position = sample.position;
    pose_.orientation = orientation_of(sample, fresh ? Eigen::Quaterniond::Identity() : pose_.orientation);
    clock_.advance(sample.t_s);
    return status;
}

PosePrediction Hold::predict(double /*lead_s*/) const noexcept {
    return pose_;
}

SampleStatus Difference::correct(const PoseSample& sample) noexcept {
    const SampleStatus status = clock_.judge(sample);
    if (status == SampleStatus::reinitialised)
        rates_.now = at_rest(sample);
    else if (status == SampleStatus::accepted)
        rates_.step_to(sample.position, orientation_of(sample, rates_.now.orientation),
                       sample.t_s - clock_.time_s());
    else
        return status;
    clock_.advance(sample.t_s);
    return status;
}

SampleStatus MovingAverage::correct(const PoseSample& sample) noexcept {
    const SampleStatus status = clock_.judge(sample);
    if (status != SampleStatus::accepted && status != SampleStatus::reinitialised) return status;
    const double dt = sample.t_s - clock_.time_s();
    clock_.advance(sample.t_s);
    if (status == SampleStatus::reinitialised) {
        window_.fill(sample);
        rates_.now = at_rest(sample);
        return status;
    }
    window_.push(sample);
    const std::size_t n = window_.size();
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Vector3d turn = Eigen::Vector3d::Zero();
    const Eigen::Quaterniond newest = window_.back(0).orientation;
    for (std::size_t age = 0; age < n; ++age) {
        position += window_.back(age).position;
        turn += logarithm(window_.back(age).orientation * newest.conjugate());
    }
    const double share = 1 / static_cast<double>(n);
    rates_.step_to(share * position, exponential(share * turn) * newest, dt);
    return status;
}

}  // namespace tracking
