#pragma once
#include <vector>

#include "body/body_path.h"

namespace sim {

// Bodies that move as prescribed: where they are is a function of time alone, so every world that holds them knows it.

/// Where a prescribed motion (one key or more) has a body at a time since the start.
[[nodiscard]] BodyPath::Pose pose_at(const std::vector<MotionKey>& motion, double time_s);

struct PrescribedState {
    BodyPath::Pose pose;
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero(),
                    spin = Eigen::Vector3d::Zero();  ///< [m/s], [rad/s], world axes
};
/// With the velocity that it came with.
[[nodiscard]] PrescribedState state_at(const std::vector<MotionKey>& motion, double time_s);

/// The path of a prescribed motion over a step that begins at a time since the start, a leg for every part between keys.
void follow_motion(const std::vector<MotionKey>& motion, double begins_s, double dt, BodyPath& path);

}  // namespace sim
