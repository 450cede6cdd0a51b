#include "body/prescribed_motion.h"

#include <algorithm>

namespace sim {
namespace {

auto key_after(const std::vector<MotionKey>& motion, double time_s) {
    return std::upper_bound(motion.begin(), motion.end(), time_s,
                            [](double time, const MotionKey& key) { return time < key.time_s; });
}

Eigen::Vector3d spin_between(const MotionKey& from, const MotionKey& to) {
    const Eigen::AngleAxisd turn(to.orientation * from.orientation.conjugate());
    // Eigen's angle is from 0 to pi: the shorter way.
    return turn.angle() / (to.time_s - from.time_s) * turn.axis();
}

Eigen::Quaterniond turned(const Eigen::Quaterniond& orientation, const Eigen::Vector3d& by) {
    const double angle = by.norm();
    return angle > 0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, by / angle)) * orientation : orientation;
}

}  // namespace

BodyPath::Pose pose_at(const std::vector<MotionKey>& motion, double time_s) {
    const auto next = key_after(motion, time_s);
    if (next == motion.begin()) return {next->position, next->orientation};
    const MotionKey& from = *std::prev(next);
    if (next == motion.end()) return {from.position, from.orientation};
    const double gone = time_s - from.time_s;
    return {from.position + gone / (next->time_s - from.time_s) * (next->position - from.position),
            turned(from.orientation, gone * spin_between(from, *next)).normalized()};
}

void follow_motion(const std::vector<MotionKey>& motion, double begins_s, double dt, BodyPath& path) {
    path.legs.clear();
    path.end = dt;
    path.inertia.setOnes();  // its momentum is its spin, which stays
    auto next = key_after(motion, begins_s);
    for (double time = 0; time < dt;) {
        const BodyPath::Pose pose = pose_at(motion, begins_s + time);
        BodyPath::Leg& leg = path.legs.emplace_back();
        leg.start = time, leg.position = pose.position, leg.orientation = pose.orientation;
        if (next != motion.begin() && next != motion.end()) {
            const MotionKey& from = *std::prev(next);
            leg.velocity = (next->position - from.position) / (next->time_s - from.time_s);
            leg.momentum = leg.spin = spin_between(from, *next);
        }
        if (next == motion.end()) return;
        time = next->time_s - begins_s;
        ++next;
    }
}

PrescribedState state_at(const std::vector<MotionKey>& motion, double time_s) {
    const auto next = std::lower_bound(motion.begin(), motion.end(), time_s,
                                       [](const MotionKey& key, double t) { return key.time_s < t; });
    PrescribedState state{pose_at(motion, time_s)};
    if (next != motion.begin() && next != motion.end()) {
        const MotionKey& from = *std::prev(next);
        state.velocity = (next->position - from.position) / (next->time_s - from.time_s);
        state.spin = spin_between(from, *next);
    }
    return state;
}

}  // namespace sim
