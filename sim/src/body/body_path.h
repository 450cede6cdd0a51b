#pragma once
#include <algorithm>
#include <vector>

#include "body/moving_body.h"

namespace sim {

/// A body's way through a step, as the island solver moves it: in each substep a steady velocity and angular
/// momentum; in one with impacts those before and after each.
struct BodyPath {
    struct Leg {
        double start = 0;                                    ///< since the step's start [s]
        Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< at the leg's start
        Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
        Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< [m/s]
        Eigen::Vector3d spin = Eigen::Vector3d::Zero();  ///< at its start, world axes [rad/s]; see set_spins
        Eigen::Vector3d momentum = Eigen::Vector3d::Zero();  ///< angular, world axes [kg m^2/s]
    };
    std::vector<Leg> legs;                              ///< one or more, starts ascending from 0
    double end = 0;                                     ///< of the last leg: the step [s]
    Eigen::Vector3d inertia = Eigen::Vector3d::Ones();  ///< [kg m^2]

    [[nodiscard]] double end_of(std::size_t leg) const noexcept {
        return leg + 1 < legs.size() ? legs[leg + 1].start : end;
    }
    [[nodiscard]] const Leg& leg_at(double time) const noexcept {
        std::size_t place = legs.size() - 1;
        while (place > 0 && legs[place].start > time) --place;
        return legs[place];
    }
    struct Pose {
        Eigen::Vector3d position;
        Eigen::Quaterniond orientation;
    };
    [[nodiscard]] Pose at(double time) const;  ///< time since the step's start [s]
    /// The integral of velocity, and of spin, to a time.
    struct Way {
        Eigen::Vector3d moved, turned;
    };
    [[nodiscard]] Way until(double time) const;
};

/// Calls visit(leg of a, leg of b, seconds) for the spans in which both go steadily, from `time` on, until
/// that returns false or the step ends.
template <typename Visit>
void along(const BodyPath& a, const BodyPath& b, double time, Visit visit) {
    std::size_t i = 0, j = 0;
    while (i < a.legs.size() && j < b.legs.size()) {
        const double ends_a = a.end_of(i), ends_b = b.end_of(j), ends = std::min(ends_a, ends_b);
        if (ends > time) {
            if (!visit(a.legs[i], b.legs[j], ends - time)) return;
            time = ends;
        }
        i += ends_a <= ends, j += ends_b <= ends;
    }
}

/// A body's angular velocity, world axes [rad/s].
[[nodiscard]] Eigen::Vector3d spin_of(const MovingBody& body, const Eigen::Quaterniond& orientation,
                                      const Eigen::Vector3d& momentum);

/// Spins of a path that has orientations and momenta: the solver writes those of all bodies, few are asked for.
void set_spins(const MovingBody& body, BodyPath& path);

/// The path of a body that nothing touches, from a state on; of one that is fixed or sleeps: that it stays. Allocates only
/// while `path` grows.
void follow_freely(const MovingBody& body, const WorldBodyState& from, const WorldSettings& settings,
                   BodyPath& path);

}  // namespace sim
