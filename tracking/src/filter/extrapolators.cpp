#include "filter/extrapolators.h"

#include "tracking/rotation.h"

namespace tracking {
namespace {

/// The sample's orientation, or `otherwise` if it has none.
Eigen::Quaterniond orientation_of(const PoseSample& sample, const Eigen::Quaterniond& otherwise) {
    return sample.has_orientation ? sample.orientation.normalized() : otherwise;
}

}  // namespace

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

PosePrediction ConstantRates::predict(double lead_s) const noexcept {
    PosePrediction pose = now_;
    pose.position += lead_s * now_.velocity;
    pose.orientation = (exponential(lead_s * now_.angular_velocity) * now_.orientation).normalized();
    return pose;
}

void ConstantRates::start(const PoseSample& sample) noexcept {
    now_ = {};
    now_.position = sample.position;
    now_.orientation = orientation_of(sample, Eigen::Quaterniond::Identity());
}

void ConstantRates::step_to(const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation,
                            double dt) noexcept {
    now_.velocity = (position - now_.position) / dt;
    now_.angular_velocity = logarithm(orientation * now_.orientation.conjugate()) / dt;
    now_.position = position;
    now_.orientation = orientation;
}

SampleStatus Difference::correct(const PoseSample& sample) noexcept {
    const SampleStatus status = clock_.judge(sample);
    if (status == SampleStatus::reinitialised)
        start(sample);
    else if (status == SampleStatus::accepted)
        step_to(sample.position, orientation_of(sample, now_.orientation), sample.t_s - clock_.time_s());
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
        start(sample);
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
    step_to(share * position, exponential(share * turn) * newest, dt);
    return status;
}

}  // namespace tracking
