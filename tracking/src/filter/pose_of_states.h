#pragma once
#include "filter/axis_state.h"
#include "tracking/motion.h"
#include "tracking/rotation.h"

namespace tracking {

/// Of a point's state; the rotation is left at rest in the identity.
[[nodiscard]] inline PosePrediction pose_of_point(const AxisStates& point) noexcept {
    PosePrediction pose;
    pose.position = point.p.head<3>();
    pose.velocity = point.v.head<3>();
    return pose;
}

/// The orientation `from` turned by the rotation vector turn.p, whose rate is turn.v.
inline void set_rotation(PosePrediction& pose, const AxisStates& turn,
                         const Eigen::Quaterniond& from) noexcept {
    pose.orientation = (exponential(turn.p.head<3>()) * from).normalized();
    pose.angular_velocity = turn.v.head<3>();
}

}  // namespace tracking
