#pragma once
#include <vector>

#include "solver/direct_solution.h"
#include "solver/energy_balance.h"
#include "solver/sweeps.h"

namespace sim {

/// Moves one island over one step.
///
/// There are two ways: sweeps over contacts (Sweeps), and direct solutions of all rows at once (DirectSolution).
///   - An island of contacts alone is swept. If that leaves its contacts far from solved, or a body rests on one 30 times lighter,
///     the step is taken anew by direct solutions, where a factorisation is cheap enough. It is kept unless it gives energy, as
///     contacts of bodies deep in each other do, which contradict each other.
///   - An island with springs is solved directly, contacts included where that is cheap enough; else springs are solved directly
///     and contacts swept, in turn. If all springs are soft and there are contacts, springs are forces in sweeps.
///   - A body that touches nothing and on which a timed force acts is solved directly: a constant force then moves it exactly.
/// In both ways impacts come first in a substep (Impacts). After the step no island that only contacts and joints hold has gained
/// energy (EnergyBalance).
///
/// A body that strikes faster than its modes can yield within what they describe is rigid in that step.
///
/// Deterministic, however many threads share it out. No allocation once the buffers have grown.
class IslandSolver {
public:
    /// paths: where the paths of bodies are written, one a body of the world.
    IslandSolver(const WorldSettings& settings, std::vector<MovingBody>& bodies,
                 std::vector<Manifold>& manifolds, std::vector<HeldConstraint>& constraints,
                 std::vector<BodyPath>& paths)
        : rows_(settings, bodies, manifolds, constraints, paths) {}

    /// Before a step: its number, from 0, and the forces that act within it, ascending by bodies; must stay.
    void begin_step(std::uint64_t step, const std::vector<ActiveForce>& forces) noexcept;
    /// Over one step. follow: in short substeps, contacts found again in each, where that can be (FoundContacts::may_follow).
    void solve(const Island& island, const ContactScene& scene, bool follow = false);
    /// The contacts that the last island ends the step with, if they were found again within it; else nullptr.
    [[nodiscard]] const std::vector<Manifold>* found() const noexcept {
        return rows_.found_again ? &rows_.found : nullptr;
    }
    /// Whether a body of it touches or is joined to what moves as prescribed.
    [[nodiscard]] bool is_carried(const Island& island) const { return rows_.is_carried(island); }
    /// What planes, fixed bodies, places, gravity and drag gave own bodies since the last call [N s].
    [[nodiscard]] Eigen::Vector3d take_outside_impulse() noexcept {
        return std::exchange(rows_.outside, Eigen::Vector3d::Zero());
    }
    [[nodiscard]] CrossImpulses& cross() noexcept { return rows_.cross; }
    [[nodiscard]] std::uint64_t deformations_limited() const noexcept {
        return rows_.limited;
    }                                                                                    ///< since the start
    [[nodiscard]] std::uint64_t constraints_broken() const noexcept { return broken_; }  ///< since the start

private:
    void begin(const Island& island, const ContactScene& scene);
    void advance();
    void solve_better();
    void go_back();
    [[nodiscard]] bool may_gain() const;
    [[nodiscard]] bool is_uneven() const;
    [[nodiscard]] bool is_far_from_solved() const;

    IslandRows rows_;
    AppliedForces forces_{rows_};
    Impacts impacts_{rows_, forces_};
    FoundContacts found_{rows_};
    Sweeps sweeps_{rows_, forces_, impacts_};
    DirectSolution direct_{rows_, forces_, impacts_, found_};
    EnergyBalance energy_{rows_};
    bool followed_ = false;  // this island is
    bool carried_ = false;   // this island is
    std::uint64_t broken_ = 0;
};

}  // namespace sim
