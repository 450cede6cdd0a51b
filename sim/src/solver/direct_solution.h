#pragma once
#include <vector>

#include "solver/applied_forces.h"
#include "solver/found_contacts.h"
#include "solver/impacts.h"
#include "solver/newton_solver.h"

namespace sim {

/// Moves an island over one substep by direct solutions, in two halves, as RATTLE (Andersen 1983) for rigid springs:
///   half of gravity; impulses P by which springs' ends meet where the bodies *will be*, and contacts close their gaps; move; the
///   other half; impulses V by which what holds has no speed between its ends
/// which is of second order and gives joints no energy while its equations are solved. P is found by Newton's method on the poses
/// at the end with the rows of the start; its steps, and V, are minima (NewtonSolver). Overlaps yield by a share of their bodies'
/// compliance, less under heavy loads; V and friction have none. Modes see all of a substep's impulse in its first half.
///
/// A substep is halved, and again, where an arm of a spring turns further than kMostTurn, Newton's method does not converge, or
/// weight moves a body by more than kMostFall of its size, and up to kStrikeLevel times where a rigid body rebounds: such
/// impacts act when a substep begins, with all joints that hold. Contacts are found again where bodies have moved on
/// (FoundContacts).
class DirectSolution {
public:
    DirectSolution(IslandRows& rows, AppliedForces& forces, Impacts& impacts, FoundContacts& found)
        : rows_(rows), forces_(forces), impacts_(impacts), found_(found), newton_(rows) {}
    DirectSolution(const DirectSolution&) = delete;
    DirectSolution& operator=(const DirectSolution&) = delete;

    /// From here on the island is solved directly; false: it is too dear, see NewtonSolver::begin.
    bool begin(double most, bool must = false);
    /// Notes whether all springs act as forces may, held over a substep. Before begin.
    void begin_step();
    [[nodiscard]] bool springs_are_soft() const noexcept { return springs_soft_; }
    /// A substep, or two of half its length where springs' ends turn too far for one, or something rebounds late in it.
    /// followed: so that no body moves far in one, see FoundContacts.
    void substep(int level, bool last, bool followed);

    /// Multiply-adds of a factorisation up to which an island is solved directly: one of contacts alone, which sweeps solve, too,
    /// and one with springs.
    [[nodiscard]] double most_with_contacts() const noexcept;
    [[nodiscard]] double most_with_springs() const noexcept;
    /// Of a step that begins. Sweeps do for soft springs among contacts, too.
    [[nodiscard]] double most_at_first() const noexcept {
        return springs_soft_ && rows_.any_contacts ? most_with_contacts() : most_with_springs();
    }

private:
    struct End {
        Eigen::Vector3d position;
        Eigen::Quaterniond orientation;
        Eigen::Vector3d momentum;  // with which it turns there [kg m^2/s]
    };
    [[nodiscard]] bool acts_as_force(SpringRows& spring);
    bool try_substep(bool last);
    void take_found(bool any);
    [[nodiscard]] bool falls_little() const;
    [[nodiscard]] bool turns_little() const;
    void follow_bodies(bool positions);
    void kick();
    void load(bool positions);
    void find_ends();
    [[nodiscard]] Eigen::Vector3d gap_at_end(const SpringRows& spring) const;
    [[nodiscard]] Eigen::Quaterniond orientation_at_end(int body) const;
    void set_firmness(SpringRows& spring, bool positions) const;
    void begin_contact(std::size_t i, const Eigen::Vector3d& seen_so_far, const Eigen::Vector3d& guess,
                       double bias, bool positions);
    bool solve_positions();
    void write_legs();
    void move();
    void solve_velocities();
    void narrow(bool positions);
    void finish(bool last);

    IslandRows& rows_;
    AppliedForces& forces_;
    Impacts& impacts_;
    FoundContacts& found_;
    NewtonSolver newton_;
    bool springs_soft_ = true;  // as the step begins
    bool fresh_ = true;         // contacts, in the first substep since they were found
    std::vector<End> ends_;     // of the bodies, at the end of the substep
};

}  // namespace sim
