#include "tracking/motion.h"

#include "motion_model.h"
#include "pose_of_states.h"

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

}  // namespace tracking
