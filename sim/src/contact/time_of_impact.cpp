#include "contact/time_of_impact.h"

namespace sim {
namespace {

constexpr int kMostDistances = 1024;
constexpr double kShare = 0.1;  // of a gap: how exactly it has to be known

PlacedConvex placed(const ConvexBody& body, const BodyPath::Pose& pose) {
    return {&body, pose.position, pose.orientation.toRotationMatrix()};
}

// A plane that parts two bodies.
struct Gap {
    Eigen::Vector3d normal;
    double width, turn_a, turn_b;  // reaches of turns
};

}  // namespace

Impact time_of_impact(const ConvexBody& a, const BodyPath& path_a, const ConvexBody& b,
                      const BodyPath& path_b, double tolerance) noexcept {
    Impact impact;
    double time = 0;
    const double radii = a.radius() + b.radius();
    Gap gap;
    while (impact.distances < kMostDistances) {
        const BodyPath::Pose at_a = path_a.at(time), at_b = path_b.at(time);
        const Eigen::Vector3d between = at_a.position - at_b.position;
        const double length = between.norm();
        if (length - radii > 0.1 * radii) {  // the balls that hold them are far apart
            gap = {between / length, length - radii, 0, 0};
        } else {
            const ConvexDistance now =
                distance_between(placed(a, at_a), placed(b, at_b), 0.25 * tolerance, kShare);
            if (!now.apart || now.gap <= tolerance) {
                impact.meets = true, impact.at_once = time == 0;
                break;
            }
            gap = {now.normal, now.gap, a.turn_reach(), b.turn_reach()};
        }
        ++impact.distances;
        double left = gap.width - 0.5 * tolerance;
        bool used_up = false;
        along(path_a, path_b, time, [&](const BodyPath::Leg& of_a, const BodyPath::Leg& of_b, double span) {
            const double closing = -gap.normal.dot(of_a.velocity - of_b.velocity) +
                                   gap.normal.cross(of_a.spin).norm() * gap.turn_a +
                                   gap.normal.cross(of_b.spin).norm() * gap.turn_b;
            used_up = closing * span > left;
            time += used_up ? left / closing : span;
            left -= closing * span;
            return !used_up;
        });
        if (!used_up) return impact;
    }
    impact.meets = true;
    impact.time = time;
    return impact;
}

}  // namespace sim
