#pragma once
#include <span>
#include <vector>

#include "solver/rows.h"

namespace sim {

class IslandRows;

/// A timed force in a step. Times in substeps since the start.
struct ActiveForce {
    const TimedForce* force;
    double from, until;  ///< until > from
    double factor;       ///< of `force`: an impulse's, 1 / substep [1/s]
};

/// Timed forces on an island's bodies, added substep by substep to those that the user applies.
class AppliedForces {
public:
    explicit AppliedForces(IslandRows& rows) : rows_(rows) {}
    AppliedForces(const AppliedForces&) = delete;
    AppliedForces& operator=(const AppliedForces&) = delete;

    /// Before a step: those that act within it, ascending by bodies; must stay.
    void begin_step(const std::vector<ActiveForce>& active) noexcept { active_ = &active; }
    void begin();              ///< of an island
    void set();                ///< those of the substep that begins, beside the user's
    void end();                ///< leaves the user's
    void count(double share);  ///< adds so much of the substep's to what came from outside

private:
    void begin(std::size_t row);
    struct Pushed {
        int row;  // of the island's bodies
        std::span<const ActiveForce> forces;
        bool pushed;  // by the user, with these:
        Eigen::Vector3d force, torque;
        Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostModes, 1> modal_force;  // not on the heap
        Eigen::Vector3d now;                                                     // of the timed ones [N]
    };

    IslandRows& rows_;
    const std::vector<ActiveForce>* active_ = nullptr;
    std::vector<Pushed> pushed_;
};

}  // namespace sim
