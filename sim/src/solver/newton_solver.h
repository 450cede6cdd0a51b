#pragma once
#include <vector>

#include "solver/block_cholesky.h"
#include "solver/island_rows.h"

namespace sim {

/// A contact in a direct solution.
struct DirectContact {
    double normal_gamma, tangent_gamma;  ///< compliances [1/kg]
    bool active;                         ///< begins before the substep ends
    bool soft;                           ///< along the normal: not held to the impulse before
    double bias;                         ///< speed along the normal that is wanted, less its sign [m/s]
    double bound;                        ///< of the friction impulse [N s]
    Eigen::Vector3d before;              ///< of `impulse`, what `start` has seen
    Eigen::Vector3d impulse;
    Eigen::Matrix3d weight, factored;  ///< second derivatives; those in the factorisation
    Eigen::Matrix3d mobility;          ///< K, where it is solved alone
    Eigen::Matrix2d tangent_inverse;   ///< of K's
};

/// Newton's method over all rows of an island at once, in double precision: the velocities y that minimise
///   1/2 |y - start|^2 + sum over rows of what they hold (a convex problem; Castro et al. 2022),
/// with H = 1 + sum of D^T D / gamma, factorised as BlockCholesky: O(bodies) for chains, stacks and trees. Overlaps yield softly,
/// so that how a load is shared out is defined; friction, and impulses without compliance, are held softly to what they were a
/// round before (a proximal point iteration), so that nothing of their softness is left. Where contacts are too dear to be
/// factorised, springs alone are, and solved in turn with sweeps over the contacts.
class NewtonSolver {
public:
    explicit NewtonSolver(IslandRows& rows) : rows_(rows) {}
    NewtonSolver(const NewtonSolver&) = delete;
    NewtonSolver& operator=(const NewtonSolver&) = delete;

    /// Prepares a factorisation of springs and contacts, or of springs alone where it would take more than `most` multiply-adds
    /// with contacts; false: none, for springs are soft and `must` is not set.
    [[nodiscard]] bool begin(double most, bool must, bool springs_are_soft);
    [[nodiscard]] bool with_contacts() const noexcept {
        return with_contacts_;
    }  ///< they are factorised, too
    [[nodiscard]] int size_of(int body) const { return sizes_[static_cast<std::size_t>(body)]; }  ///< of y

    void forget_factor() noexcept { factored_ = false; }  ///< rows or springs change
    /// Takes over a row triple as IslandRows wrote it. modes_yield: how modes answer impulses, as a factor of their rows.
    void widen(Rows& rows, double modes_yield);
    /// A contact is to start from its `before`, of which `start` has seen a part.
    void begin_contact(std::size_t i, const Eigen::Vector3d& seen_so_far);
    void minimise();         ///< with the contacts as they are bound now
    void settle_contacts();  ///< the contacts' impulses and the velocities
    void hold_modes(
        double modes_yield);  ///< `held` by the impulses of contacts, and those with which springs moved

    [[nodiscard]] Eigen::Vector3d seen(const Rows& rows, const AlignedDoubles& of) const;
    void give(const Rows& rows, const Eigen::Vector3d& impulse, AlignedDoubles& to) const;

    /// Body by body sqrt(m) v, sqrt(I) w, modes: what is sought; with what is taken for given; before impulses; of modes, what the
    /// impulses of the first half of a substep give over all of it.
    AlignedDoubles y, start, free, held;
    std::vector<DirectContact> contacts;  ///< as IslandRows::contacts

private:
    [[nodiscard]] bool is_too_dear(double most) const;
    void reserve();
    [[nodiscard]] Eigen::Vector3d impulse_of(const DirectContact& contact,
                                             const Eigen::Vector3d& speed) const;
    void find_gradient();
    [[nodiscard]] Eigen::Matrix3d weight_of(const ContactRows& contact, const DirectContact& direct) const;
    void assemble();
    [[nodiscard]] double left_open() const;
    void set_mobility(const ContactRows& contact, DirectContact& direct) const;
    [[nodiscard]] Eigen::Vector3d solve_alone(const ContactRows& contact, DirectContact& direct) const;
    void settle_in_turn();

    IslandRows& rows_;
    BlockCholesky factor_;
    bool factored_ = false;  // rows and springs have not changed since
    bool with_contacts_ = false;
    std::vector<int> sizes_;  // of y, per body
    AlignedDoubles wide_rows_, gradient_, step_;
};

}  // namespace sim
