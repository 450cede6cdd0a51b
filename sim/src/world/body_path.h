#pragma once
#include <vector>

#include "world/moving_body.h"

namespace sim {

/// A body's way through a step, as the island solver moves it: in each substep a steady velocity and spin.
struct BodyPath {
    struct Leg {
        Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< at the leg's start
        Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
        Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< [m/s]
        Eigen::Vector3d spin = Eigen::Vector3d::Zero();      ///< world axes [rad/s]; see set_spins
        Eigen::Vector3d momentum = Eigen::Vector3d::Zero();  ///< angular, world axes [kg m^2/s]
    };
    std::vector<Leg> legs;  ///< one a substep

    struct Pose {
        Eigen::Vector3d position;
        Eigen::Quaterniond orientation;
    };
    [[nodiscard]] Pose at(double time, double substep) const;  ///< time since the step's start [s]
    /// The integral of velocity, and of spin, to a time.
    struct Way {
        Eigen::Vector3d moved, turned;
    };
    [[nodiscard]] Way until(double time, double substep) const;
    [[nodiscard]] double length(double substep) const;  ///< of all legs [m]
    [[nodiscard]] double turn(double substep) const;    ///< of all legs [rad]
};

/// A body's angular velocity, world axes [rad/s].
[[nodiscard]] Eigen::Vector3d spin_of(const MovingBody& body, const Eigen::Quaterniond& orientation,
                                      const Eigen::Vector3d& momentum);

/// Spins of a path that has orientations and momenta: the solver writes those of all bodies, few are asked for.
void set_spins(const MovingBody& body, BodyPath& path);

/// The path of a body that nothing touches; of one that is fixed or sleeps: that it stays. Allocates only
/// while `path` grows.
void follow_freely(const MovingBody& body, const WorldSettings& settings, BodyPath& path);

}  // namespace sim
