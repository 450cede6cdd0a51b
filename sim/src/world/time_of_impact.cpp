#include "world/time_of_impact.h"

#include <algorithm>

namespace sim {
namespace {

constexpr int kMostDistances = 128;
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
                      const BodyPath& path_b, double substep, double tolerance) noexcept {
    Impact impact;
    const std::size_t legs = path_a.legs.size();
    std::size_t leg = 0;
    double time = 0;
    const double radii = a.radius() + b.radius();
    Gap gap;
    while (impact.distances < kMostDistances) {
        const BodyPath::Pose at_a = path_a.at(time, substep), at_b = path_b.at(time, substep);
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
        for (; leg < legs; ++leg) {
            const BodyPath::Leg &of_a = path_a.legs[leg], &of_b = path_b.legs[leg];
            const double closing = -gap.normal.dot(of_a.velocity - of_b.velocity) +
                                   of_a.spin.cross(gap.normal).norm() * gap.turn_a +
                                   of_b.spin.cross(gap.normal).norm() * gap.turn_b;
            const double end = substep * static_cast<double>(leg + 1), span = end - time;
            if (closing * span > left) {
                time += left / closing;
                break;
            }
            left -= closing * span;
            time = end;
        }
        if (leg == legs) return impact;
    }
    impact.meets = true;
    impact.time = time;
    return impact;
}

}  // namespace sim
