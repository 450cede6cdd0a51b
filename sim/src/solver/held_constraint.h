#pragma once
#include <array>

#include "body/body_kind.h"

namespace sim {

/// A point of a that a constraint holds along some directions.
struct HeldPoint {
    Eigen::Vector3d a, b;        ///< rest frame of a; of b, or the world
    Eigen::Matrix3d directions;  ///< rows: unit, or zero where the point is free; see `turns`
    int held = 3;                ///< directions that are not zero
    bool turns =
        false;  ///< the directions are of b's frame and the impulse acts at a's point; else both are of
                ///< the world and it acts half-way between the points
    Eigen::Vector3f impulse =
        Eigen::Vector3f::Zero();  ///< of the last substep on a, along the directions [N s]

    /// From b's point to a's [m], along the directions.
    [[nodiscard]] Eigen::Vector3d gap(const Eigen::Vector3d& at_a, const Eigen::Vector3d& at_b,
                                      const Eigen::Quaterniond& orientation_b) const {
        return turns ? Eigen::Vector3d(directions * (orientation_b.conjugate() * (at_a - at_b)))
                     : at_a - at_b;
    }
};

/// A constraint as it is being held.
struct HeldConstraint {
    PointConstraint definition;
    std::array<HeldPoint, kMostHeldPoints> points;
    int count = 0;         ///< of points
    bool collides = true;  ///< its bodies do
    bool holds = true;
};

/// The points that a constraint holds, and whether its bodies collide. b: nullptr for the world.
[[nodiscard]] HeldConstraint held_constraint(const PointConstraint& definition, const BodyKind& a,
                                             const BodyKind* b);

}  // namespace sim
