#pragma once
#include <vector>

#include "solver/rows.h"

namespace sim {

class IslandRows;

/// Impulses that an own body and a ghost gave each other in one step.
struct CrossImpulse {
    int own, ghost;
    bool rebound = false;                              ///< they rebounded, or were stopped where they met
    Eigen::Vector3d linear = Eigen::Vector3d::Zero();  ///< on the own body; the ghost's is opposite [N s]
    Eigen::Vector3d angular_own = Eigen::Vector3d::Zero();    ///< about its centre, world axes [N m s]
    Eigen::Vector3d angular_ghost = Eigen::Vector3d::Zero();  ///< likewise of the ghost
};

/// What own bodies get from other owners' bodies (ghosts), and what watched own bodies get from other own ones, for the owners
/// to exchange. Only in worlds that are shared.
class CrossImpulses {
public:
    explicit CrossImpulses(IslandRows& rows) : rows_(rows) {}
    CrossImpulses(const CrossImpulses&) = delete;
    CrossImpulses& operator=(const CrossImpulses&) = delete;

    /// Before a step: forgets all pairs. recorded: whether contacts of own bodies with ghosts are from now on.
    void begin_step(bool recorded) {
        pairs_.clear();
        recorded_ = recorded;
    }
    [[nodiscard]] bool recorded() const noexcept { return recorded_; }
    /// Pairs of all islands of the step.
    [[nodiscard]] const std::vector<CrossImpulse>& pairs() const noexcept { return pairs_; }
    /// Adds what an own body and a ghost gave each other besides.
    void add(const CrossImpulse& more);
    /// Forgets the pairs of a body whose island is solved once more.
    void forget(int body);

    // Of the island that is being solved.
    void begin_island() noexcept {
        first_ = pairs_.size();
        any_ = false;
    }
    void go_back() { pairs_.resize(first_); }  ///< to where it began
    /// Whether a ghost takes part. Such an island is always swept: it is a part of a larger one, which would be.
    [[nodiscard]] bool among_ghosts() const noexcept { return pairs_.size() > first_; }
    [[nodiscard]] bool any() const noexcept { return any_; }  ///< row triple that is recorded
    /// Sets `pair` and `recorded` of a contact's rows.
    void note(ContactRows& contact);
    /// Whether a spring's impulses are recorded.
    [[nodiscard]] bool note(const SpringRows& spring) { return note_watched(spring, false); }
    void note_rebound(const ContactRows& contact) {
        if (contact.pair >= 0) pairs_[static_cast<std::size_t>(contact.pair)].rebound = true;
    }
    /// Adds an impulse of a recorded row triple. pair: as its `pair`; along: the impulse along the rows.
    void record(const Rows& rows, int pair, const Eigen::Vector3d& impulse, const float (&along)[3],
                const Eigen::Vector3d& point);
    /// Bodies of two owners rebound if they touch no other body that moves, as far as this world knows. Each owner sees the
    /// other's bodies as they were some steps ago: in a heap they would rebound from what is no longer there, and gain energy.
    void drop_rebounds();

private:
    [[nodiscard]] int pair_of(const Manifold& manifold);
    bool note_watched(const Rows& rows, bool contact);

    IslandRows& rows_;
    std::vector<CrossImpulse> pairs_;
    std::size_t first_ = 0;  // of the island
    bool recorded_ = false, any_ = false;
    std::vector<int> neighbours_;  // of each body, drop_rebounds
};

}  // namespace sim
