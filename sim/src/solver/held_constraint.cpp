#include "solver/held_constraint.h"

#include <algorithm>

namespace sim {
namespace {

constexpr double kWithin =
    1e-3;  // beyond a surface that still counts as within, share of the smallest half extent

bool is_within(const BodyKind& kind, const Eigen::Vector3d& point) {
    return kind.surface.distance(point).distance <= kWithin * kind.half_box.minCoeff();
}

double extent_of(const BodyKind& kind) {
    return 2 * kind.half_box.maxCoeff();
}

}  // namespace

HeldConstraint held_constraint(const PointConstraint& c, const BodyKind& a, const BodyKind* b) {
    HeldConstraint held;
    held.definition = c;
    held.collides = c.collide.value_or(!b || !is_within(a, c.point_a) || !is_within(*b, c.point_b));
    if (c.joint == Joint::ball) {
        held.points[0] = {c.point_a, c.point_b, Eigen::Matrix3d::Identity()};
        held.count = 1;
        return held;
    }
    const double half = std::min(extent_of(a), b ? extent_of(*b) : extent_of(a)) / 2;
    const Eigen::Matrix3d axes = c.frame_b.toRotationMatrix().transpose();
    // At a place of the joint's frame, along those of its axes that are set.
    auto add = [&](const Eigen::Vector3d& place, const Eigen::Vector3d& along) {
        HeldPoint& point = held.points[static_cast<std::size_t>(held.count++)];
        point = {c.point_a + c.frame_a * (half * place), c.point_b + c.frame_b * (half * place),
                 along.asDiagonal() * axes, static_cast<int>(along.sum()), true};
    };
    const bool hinge = c.joint == Joint::hinge;
    add({1, 0, 0}, {hinge ? 1. : 0., 1, 1});
    add({-1, 0, 0}, {0, 1, 1});
    if (!hinge) add({0, 1, 0}, {0, 0, 1});
    return held;
}

}  // namespace sim
