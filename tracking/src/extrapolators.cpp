#include "extrapolators.h"

#include <algorithm>

#include "rotation.h"

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

MovingAverage::MovingAverage(std::size_t count, double window_s)
    : count_(count), window_s_(window_s), ring_(kCapacity) {}

std::unique_ptr<MovingAverage> MovingAverage::of_count(std::size_t count) {
    return std::unique_ptr<MovingAverage>(new MovingAverage(count, 0));
}

std::unique_ptr<MovingAverage> MovingAverage::of_window(double window_s) {
    return std::unique_ptr<MovingAverage>(new MovingAverage(0, window_s));
}

const PoseSample& MovingAverage::back(std::size_t age) const noexcept {
    return ring_[(newest_ + kCapacity - age) % kCapacity];
}

void MovingAverage::push(const PoseSample& sample) noexcept {
    const Eigen::Quaterniond known = held_ > 0 ? back(0).orientation : Eigen::Quaterniond::Identity();
    newest_ = (newest_ + 1) % kCapacity;
    ring_[newest_] = sample;
    ring_[newest_].orientation = orientation_of(sample, known);
    held_ = std::min(held_ + 1, kCapacity);
}

void MovingAverage::restart(const PoseSample& sample) noexcept {
    held_ = 0;
    for (std::size_t i = 0; i < std::max<std::size_t>(count_, 1); ++i) push(sample);
    rates_.now = at_rest(sample);
}

std::size_t MovingAverage::in_window() const noexcept {
    if (count_ > 0) return count_;
    constexpr double kSlack = 1e-6;
    std::size_t n = 1;
    while (n < held_ && back(0).t_s - back(n).t_s < window_s_ - kSlack) ++n;
    return n;
}

SampleStatus MovingAverage::correct(const PoseSample& sample) noexcept {
    const SampleStatus status = clock_.judge(sample);
    if (status != SampleStatus::accepted && status != SampleStatus::reinitialised) return status;
    const double dt = sample.t_s - clock_.time_s();
    clock_.advance(sample.t_s);
    if (status == SampleStatus::reinitialised) {
        restart(sample);
        return status;
    }
    push(sample);
    const std::size_t n = in_window();
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Vector3d turn = Eigen::Vector3d::Zero();
    const Eigen::Quaterniond to_newest = back(0).orientation.conjugate();
    for (std::size_t age = 0; age < n; ++age) {
        position += back(age).position;
        turn += logarithm(back(age).orientation * to_newest);
    }
    const double share = 1 / static_cast<double>(n);
    rates_.step_to(share * position, exponential(share * turn) * back(0).orientation, dt);
    return status;
}

}  // namespace tracking
