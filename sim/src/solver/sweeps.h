#pragma once
#include <vector>

#include "solver/applied_forces.h"
#include "solver/impacts.h"
#include "solver/island_rows.h"

namespace sim {

/// Moves an island over one substep by sweeps over its contacts (Catto 2024, "Solver2D: soft step"; Macklin et al. 2019, "Small
/// steps in physics simulation"), for bodies with modes.
///
/// A substep of h, for every body with coordinates y = (sqrt(m) v, sqrt(I) w, G):
///   1. v <- v + h g; modes: free mean rate G0 = (z_free(h) - z) / h; impacts (Impacts); last impulses applied (warm start)
///   2. one sweep over contacts, overlaps pushed out softly (30 Hz, damping 10, at most 3 m/s)
///   3. positions and orientations move with these velocities
///   4. two sweeps without the push, so that it leaves no speed behind; with one, soft piles simmer (bodies that came deep into
///      each other are pushed in a sweep of their own that only positions see)
///   5. modes step exactly under the force P / h held over h: z1 = z + h G, z1' = c z + d z' + (b / h) P
/// and at the end of the last substep restitution. Springs are forces here, half before bodies move, half after (velocity
/// Verlet). Contact forces act on a mode with its compliance over the substep, w = (1 - a) / (omega h)^2 >= 0 (body_kind.h), so
/// rigid, stiff and soft bodies go through one solver, and the force's work on a pair without push is -1/2 P J M^-1 J^T P of the
/// rigid part: never positive, for any omega h.
///
/// Deterministic: sweeps go over contacts in an order that is a function of the bodies and their places alone (IslandBlocks;
/// within a block see IslandRows), however many threads share them out.
class Sweeps {
public:
    Sweeps(IslandRows& rows, AppliedForces& forces, Impacts& impacts);
    Sweeps(const Sweeps&) = delete;
    Sweeps& operator=(const Sweeps&) = delete;

    /// carried: the island touches what moves as prescribed (IslandRows::is_carried). last: of the step.
    void substep(bool carried, bool last);
    /// By how much speeds miss what contacts demand, at most [m/s]: the change of the impulses that would satisfy a contact
    /// alone, as a speed.
    [[nodiscard]] double residual() const;

private:
    using Block = IslandBlocks::Block;
    /// A part of a substep: of the contacts of a block, or of the bodies of its slab. Phases are put together and then done in
    /// one hand-out, see IslandBlocks::run.
    struct Phase {
        void (Sweeps::*act)(const Block& block);
        bool of_bodies;
    };
    void contacts(void (Sweeps::*act)(const Block&)) { phases_.push_back({act, false}); }
    void bodies(void (Sweeps::*act)(const Block&)) { phases_.push_back({act, true}); }
    void run();
    /// What a slab's bodies add to sums, in the order of sweeps.
    struct Sums {
        Eigen::Vector3d outside = Eigen::Vector3d::Zero();
        std::uint64_t limited = 0;
    };
    enum class Push { none, soft, all };

    // Phases, in the order of a substep.
    void follow_motions(const Block& block);
    void turn_frames(const Block& slab);
    void turn_rows(const Block& block);
    void load(const Block& slab);
    void warm_start(const Block& block);
    template <Push kPush>
    void sweep(const Block& block);
    void keep(const Block& slab);
    void give_to_move(const Block& block);
    void move(const Block& slab);
    void follow_rows(const Block& block);
    void note_works(const Block& block);
    void rebound(const Block& block);
    void give_the_rest(const Block& block);
    void finish(const Block& slab);

    void warm_start(ContactRows& contact);
    [[nodiscard]] bool may_push_out() const;
    void pull_springs();
    void move(BodyRows& body);
    void finish(const BodyRows& body, Sums& sums);
    void take_sums();
    [[nodiscard]] float residual(const ContactRows& contact) const;

    IslandRows& rows_;
    AppliedForces& forces_;
    Impacts& impacts_;
    std::vector<Phase> phases_;  // that run() will do
    std::vector<Sums> sums_;     // of each slab
    bool pushes_out_ = false;    // in this substep: see may_push_out
    float push_rate_ = 0, mass_share_ = 1, impulse_share_ = 0;
};

}  // namespace sim
