#pragma once
#include <vector>

#include "shared/foreign_bodies.h"
#include "world/shared_world.h"

namespace sim {

/// Steps of one worker after which the impulses that others found in it have been compared, in a run of this
/// bound.
[[nodiscard]] constexpr int comparison_steps(int bound) {
    constexpr int kMostBound = 64;
    return 2 * (bound < kMostBound ? bound : kMostBound) + 8;
}

/// Messages of so many steps are kept for the comparison.
[[nodiscard]] constexpr int kept_steps(int bound) {
    return 2 * comparison_steps(bound);
}

/// Contacts between bodies of two owners. Both owners resolve such a contact, each against the ghost that it
/// knows, and send the impulses that they found. If a body got I from its own owner's solution of a step and
/// I' from the other one's, it is corrected by (I' - I) / 2, and the other body by the opposite. So momentum
/// is kept to the last bit. (Both solve the interface and split the difference: an additive Schwarz method.
/// The correction comes a step late: chaotic relaxation, Chazan and Miranker 1969.)
///
/// A rebound is not split: two owners may find it in different steps, and half of each would be no rebound.
/// If either owner finds a rebound in a step, the impulse counts that the owner of the body with the lower
/// number found in that step, as a whole. This impulse may be zero. Then that owner meets the other body
/// where the correction puts it (ForeignBodies::add_rebounds_unknown_to_owner). So the impulse that counts
/// follows from the step alone, and both workers come to the same. The impulses at a body that was just
/// bought are compared once its new owner has received what others found at it (FoundMessage).
class SharedContacts {
public:
    /// By body.
    struct Owners {
        const std::vector<std::uint8_t>& own;      ///< this worker owns it
        const std::vector<std::uint8_t>& waiting;  ///< own, but what others found at it has not all come
        const std::vector<std::uint32_t>& owner;   ///< registered
    };
    SharedContacts(SharedWorld& world, const ForeignBodies& foreign, std::uint32_t self, Owners owners,
                   int keep);

    /// Compares once what this worker and `worker` found in a step that both have done, and corrects own
    /// bodies. `now`: steps done here.
    void compare(std::uint32_t worker, std::uint64_t step, std::uint64_t now);
    /// The same for one body that was bought, for the steps after `from` up to `until`.
    void compare_bought(int body, std::uint32_t worker, std::uint64_t from, std::uint64_t until);
    /// Owner of a body in its step `step`, as far as is known.
    [[nodiscard]] std::uint32_t owner(int body, std::uint64_t step) const;
    void add_sale(const PastSale& sale) {
        sales_.push_back(sale);
    }  ///< sales of a body come in the order of steps

private:
    void compare_body(int body, std::uint32_t worker, std::uint64_t step);
    void correct(const CrossImpulse* own, const CrossImpulse* theirs);

    SharedWorld* world_;
    const ForeignBodies* foreign_;
    std::uint32_t self_;
    Owners owners_;
    std::uint64_t keep_;
    std::vector<PastSale> sales_;  // of the steps that are kept
    std::vector<int> touched_;     // own bodies of the comparison under way
};

}  // namespace sim
