#pragma once
#include <map>
#include <vector>

#include "shared/foreign_bodies.h"
#include "world/shared_world.h"

namespace sim {

/// What others found in a step is compared before so many later ones, in a run of this bound.
[[nodiscard]] constexpr int comparison_steps(int bound) {
    constexpr int kMostBound = 64;
    return 2 * (bound < kMostBound ? bound : kMostBound) + 8;
}

/// So many steps are kept for that.
[[nodiscard]] constexpr int kept_steps(int bound) {
    return 2 * comparison_steps(bound);
}

/// Contacts between bodies of two owners. Both owners resolve them, each against the ghost that it knows, and
/// tell what they found. A body that got I from its own owner's solution of a step, and I' by the other one's, is put right by
/// (I' - I) / 2; the other body by the opposite, so momentum is kept to the last bit. (Both solve the interface and
/// split the difference: an additive Schwarz method, here a step late: chaotic relaxation, Chazan and Miranker 1969.)
///
/// A rebound is not split: two owners may see it in different steps, and half of each would be no rebound. If either finds one
/// in a step, what the owner of the body with the lower number found in that step counts, as a whole: perhaps nothing, and then that
/// owner meets the other body as it should be (ForeignBodies::add_owed). So what counts follows from the step alone, and whoever
/// compares finds the same; of a body that was just bought once it has heard what others found at it (FoundMessage).
class SharedContacts {
public:
    /// By body: whether this worker owns it, and knows what others found at it; and who does, as registered.
    struct Owners {
        const std::vector<std::uint8_t>& own;
        const std::vector<std::uint8_t>& awaits;  ///< it does not know that yet
        const std::vector<std::uint32_t>& owner;
    };
    SharedContacts(SharedWorld& world, const ForeignBodies& heard, std::uint32_t self, Owners owners,
                   int keep);

    /// The own bodies and `worker` have done `step`: what both found is compared, once. `now`: steps done here.
    void compare(std::uint32_t worker, std::uint64_t step, std::uint64_t now);
    /// Who did a body's step `step`, as far as is known.
    [[nodiscard]] std::uint32_t owner(int body, std::uint64_t step) const;
    void sold(const PastSale& sale) { sales_.push_back(sale); }  ///< of each body in the order of steps
    /// All is known that `worker` found at a body that came here: it is compared for the steps after `from` up to `until`.
    void took(int body, std::uint32_t worker, std::uint64_t from, std::uint64_t until);

private:
    struct Shares {
        double found, told;  ///< of what was found here, of what the other told
    };
    [[nodiscard]] static Shares shares(const CrossImpulse* found, const CrossImpulse* told);
    struct Occasion {
        std::uint32_t worker;  ///< whose bodies the other ones were
        std::uint64_t step;
    };
    void put_right(const CrossImpulse* found, const CrossImpulse* told);
    void compare(const Occasion& of, int body);
    [[nodiscard]] const PastSale* sale_after(int body, std::uint64_t step) const;
    SharedWorld* world_;
    const ForeignBodies* heard_;
    std::uint32_t self_;
    Owners owners_;
    std::uint64_t keep_;
    std::vector<PastSale> sales_;  // of the last steps
    std::vector<int> touched_;     // of a comparison
};

}  // namespace sim
