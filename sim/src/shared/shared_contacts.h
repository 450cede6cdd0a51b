#pragma once
#include <map>
#include <vector>

#include "shared/foreign_bodies.h"

namespace sim {

/// Steps over which a blow that one owner saw is looked for at the other one, in a run of this bound.
[[nodiscard]] constexpr int blow_window(int bound) {
    constexpr int kMostBound = 64;
    return 2 * (bound < kMostBound ? bound : kMostBound) + 8;
}

/// Contacts between bodies of two owners, in bounded pace. Both owners resolve them, each against the ghost that it knows, and
/// tell what they found. A body that got I from its own owner's solution of a step, and I' by the other one's, is put right by
/// (I' - I) / 2; the other body by the opposite, so momentum is kept to the last bit. (Both solve the interface and
/// split the difference: an additive Schwarz method, here a step late: chaotic relaxation, Chazan and Miranker 1969.)
///
/// A blow (a rebound) is not split: two owners may see it in different steps, and half of each would be no
/// rebound. It counts as who saw it first has it, of two in one step the owner of the body with the lower number;
/// the other body is put right as a whole. A blow that one owner sees is the first one of the last `window` steps that the
/// other one saw and that was not yet paired. If in a step only one of two finds a blow, that or the other's counts, as a whole. This follows from the messages of these steps alone, so whoever compares finds
/// the same; of a body that was just bought once it has heard what others found at it (FoundMessage).
class SharedContacts {
public:
    /// By body: whether this worker owns it, and knows what others found at it; and who does, as registered.
    struct Owners {
        const std::vector<std::uint8_t>& own;
        const std::vector<std::uint8_t>& awaits;  ///< it does not know that yet
        const std::vector<std::uint32_t>& owner;
    };
    SharedContacts(World& world, const ForeignBodies& heard, std::uint32_t self, Owners owners, int keep,
                   int window);

    /// The own bodies and `worker` have done `step`: what both found is compared, once. `now`: steps done here.
    void compare(std::uint32_t worker, std::uint64_t step, std::uint64_t now);
    /// Who did a body's step `step`, as far as is known.
    [[nodiscard]] std::uint32_t owner(int body, std::uint64_t step) const;
    /// A body was sold by `before`; from the end of `step` on another owner has it.
    void sold(int body, std::uint32_t before, std::uint64_t step);
    /// All is known that `worker` found at a body that came here: it is compared for the steps after `from` up to `until`.
    void took(int body, std::uint32_t worker, std::uint64_t from, std::uint64_t until);

private:
    struct Sale {
        int body;
        std::uint32_t before;
        std::uint64_t step;
    };
    struct Shares {
        double found, told;  ///< of what was found here, of what the other told
    };
    [[nodiscard]] Shares shares(const CrossImpulse* found, const CrossImpulse* told,
                                std::uint64_t step) const;
    [[nodiscard]] const CrossImpulse* found_by_owner(int body, int other, std::uint64_t step) const;
    [[nodiscard]] int blows_ahead(int low, int high, std::uint64_t step) const;
    struct Occasion {
        std::uint32_t worker;  ///< whose bodies the other ones were
        std::uint64_t step;
    };
    void put_right(const CrossImpulse* found, const CrossImpulse* told, const Occasion& of);
    void compare(const Occasion& of, int body);
    [[nodiscard]] const Sale* sale_after(int body, std::uint64_t step) const;
    World* world_;
    const ForeignBodies* heard_;
    std::uint32_t self_;
    Owners owners_;
    std::uint64_t keep_, window_;
    std::vector<Sale> sales_;   // of the last steps
    std::vector<int> touched_;  // of a comparison
};

}  // namespace sim
