#pragma once
#include <vector>

#include "body/step_impulse.h"
#include "sim/world.h"
#include "solver/cross_impulses.h"

namespace sim {

/// A ball that holds a foreign body over the next step.
struct ForeignBall {
    int body;
    Eigen::Vector3d center;
    double radius;  ///< of the body, plus the distance it may travel [m]
};

/// A world that is shared with worlds of other processes, which hold the same bodies: only own bodies are stepped, among ghosts,
/// copies of other worlds' bodies that are placed for one step and move with them. At first all bodies are own.
class SharedWorld : public World {
public:
    explicit SharedWorld(const WorldDefinition& definition);

    void set_own(int body, bool own);
    [[nodiscard]] bool own(int body) const;
    [[nodiscard]] WorldRecord record(int body) const;  ///< at the end of the last step
    void record(int body, WorldRecord& out) const;     ///< the same, into storage that is there
    void restore(const WorldRecord& record);           ///< sets a body's state; wakes no other body
    void set_step(std::uint64_t step);                 ///< time_s and counts().steps continue from here

    /// Those of `foreign` that have to be placed for the next step, because they may touch an own body.
    void near_own(const std::vector<ForeignBall>& foreign, std::vector<int>& near);
    /// The same for one of them whose state is known better, after near_own.
    [[nodiscard]] bool is_near_own(int body, const WorldBodyState& state) const;
    /// Places a ghost for the next step only; it moves under gravity and `held`.
    void place_ghost(int body, const WorldBodyState& state, const StepImpulse* held, bool asleep = false);
    /// Gives an own body, as rigid, an impulse [N s, N m s].
    void kick(int body, const Eigen::Vector3d& linear, const Eigen::Vector3d& angular);
    /// One step of a body that touches nothing but planes, which stop it, under gravity and `held`.
    void extrapolate(int body, WorldBodyState& state, const StepImpulse* held);
    /// Records what an own body gets from other own bodies and from constraints: other owners' ghosts of it are held by that.
    void watch(int body, bool watched);

    // Of the last step.
    /// Every pair of an own body and a ghost that gave each other an impulse.
    [[nodiscard]] const std::vector<CrossImpulse>& cross_impulses() const noexcept;
    [[nodiscard]] const StepImpulse* impulse(int body) const;  ///< on a watched body; nullptr: none
    [[nodiscard]] int cross_contacts() const noexcept;         ///< points between own bodies and ghosts
    /// A body's share of the work, in units of an own body without contacts.
    [[nodiscard]] double work(int body) const;

    /// Radius of a ball that holds the body as deformed as it may be [m].
    [[nodiscard]] double most_radius(int body) const;
    [[nodiscard]] double radius_now(int body) const;  ///< likewise as it is deformed now [m]
};

}  // namespace sim
