#include "tracking/motion.h"

#include <algorithm>

#include "filter/motion_model.h"
#include "filter/pose_of_states.h"

namespace tracking {
namespace {

MotionModel model_of(MotionLaw law, double rate) {
    switch (law) {
        case MotionLaw::decaying_velocity:
            return {MotionModel::DecayingVelocity{rate, 0}};
        case MotionLaw::decaying_acceleration:
            return {MotionModel::Singer{rate, 0}};
        case MotionLaw::constant:
            break;
    }
    return {MotionModel::ConstantAcceleration{0}};
}

Eigen::Quaterniond turned(const Eigen::Quaterniond& from, const Eigen::Vector3d& by) {
    return (exponential(by) * from).normalized();
}

}  // namespace

PosePrediction Motion::after(double lead_s) const noexcept {
    const Transition f = model_of(law, rate).transition(lead_s);
    PosePrediction pose =
        pose_of_point(f * AxisStates{to_lanes(position), to_lanes(velocity), to_lanes(acceleration)});
    set_rotation(pose,
                 f * AxisStates{to_lanes(turn), to_lanes(angular_velocity), to_lanes(angular_acceleration)},
                 orientation);
    return pose;
}

Motion steady_motion(const PosePrediction& from) noexcept {
    Motion motion;
    motion.position = from.position;
    motion.velocity = from.velocity;
    motion.orientation = from.orientation;
    motion.angular_velocity = from.angular_velocity;
    return motion;
}

PosePrediction pose_between(const PosePrediction& a, const PosePrediction& b, double step_s,
                            double past_s) noexcept {
    const double s = past_s / step_s;
    const double from_b = s * s * (3 - 2 * s), va = s * (1 - s) * (1 - s), vb = s * s * (s - 1);
    const double slope = 6 * s * (1 - s), wa = (1 - s) * (1 - 3 * s), wb = s * (3 * s - 2);
    const Eigen::Vector3d way = b.position - a.position;
    PosePrediction pose = a;
    pose.position += from_b * way + step_s * (va * a.velocity + vb * b.velocity);
    pose.velocity = slope / step_s * way + wa * a.velocity + wb * b.velocity;
    pose.orientation = turned(a.orientation, s * logarithm(b.orientation * a.orientation.conjugate()));
    pose.angular_velocity = (1 - s) * a.angular_velocity + s * b.angular_velocity;
    return pose;
}

PosePrediction pose_beyond(const PosePrediction& a, double past_s) noexcept {
    PosePrediction pose = a;
    pose.position += past_s * a.velocity;
    pose.orientation = turned(a.orientation, past_s * a.angular_velocity);
    return pose;
}

void SampledMotion::set(std::size_t i, const PosePrediction& pose) noexcept {
    double* to = std::copy_n(pose.position.data(), 3, poses_[i].data());
    to = std::copy_n(pose.velocity.data(), 3, to);
    to = std::copy_n(pose.orientation.coeffs().data(), 4, to);
    std::copy_n(pose.angular_velocity.data(), 3, to);
}

PosePrediction SampledMotion::pose(std::size_t i) const noexcept {
    const double* from = poses_[i].data();
    return {Eigen::Map<const Eigen::Vector3d>(from), Eigen::Map<const Eigen::Vector3d>(from + 3),
            Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(from + 6)),
            Eigen::Map<const Eigen::Vector3d>(from + 10)};
}

PosePrediction SampledMotion::after(double lead_s) const noexcept {
    std::size_t i = 0;  // the last pose at or before that lead
    while (i < pieces_ && this->lead_s(i + 1) <= lead_s) ++i;
    const double begin_s = this->lead_s(i), past_s = lead_s - begin_s;
    if (!(past_s > 0)) return pose(i);
    if (i == pieces_) return pose_beyond(pose(i), past_s);
    return pose_between(pose(i), pose(i + 1), this->lead_s(i + 1) - begin_s, past_s);
}

}  // namespace tracking
