#pragma once
#include <array>
#include <span>

#include "contact/crew.h"
#include "contact/manifold.h"

namespace sim {

constexpr std::size_t kLeastDivided = 100;  ///< bodies of an island that is divided
constexpr std::size_t kMostSlabs = 64;

/// The order in which the contacts of an island are swept, in blocks that several threads may sweep at once: Gauss-Seidel
/// with the domain decomposed (as Preclik and Ruede 2015 part theirs, but without splitting bodies: every contact sees the
/// newest velocities).
///
/// Space is cut square to the axis along which the island is longest, into slabs as thin as contacts between their bodies allow,
/// in steps from one and a quarter to two mean diameters of the bodies, at multiples of that from the world's origin: what
/// rests keeps its slab while no contact reaches further. Contacts of bodies in one slab are its
/// interior, those of bodies in neighbouring slabs an interface. Swept are, each by ids: all interiors, interfaces after
/// even slabs, those after odd ones, and what reaches further (long bodies among small ones). Blocks without a slab in common
/// commute; those with one keep this order, so the result is to the bit that of one thread which does block after block,
/// for any number of threads. An island of less than kLeastDivided bodies, or in one slab, is one block, swept by ids.
class IslandBlocks {
public:
    struct Block {
        std::uint32_t first = 0, last = 0;  ///< of the island's contacts, in the order of sweeps
        std::uint32_t slab = 0, slabs = 1;  ///< whose bodies it touches: so many from the first
        std::uint32_t before = 0;           ///< blocks of its first slab that come before it in a sweep ...
        std::uint32_t before_next = 0;      ///< ... and of the next slab
    };
    struct Body {
        Eigen::Vector3d place;  ///< of its centre [m]
        double diameter;        ///< [m]
    };

    /// Divides an island of the given bodies and manifolds (ascending by key; indices into `all`). local: each body's place
    /// among `bodies`, or -1 if it does not move.
    void divide(Crew& crew, std::span<const Body> bodies, std::span<const int> manifolds,
                const std::vector<Manifold>& all, const std::vector<int>& local);

    [[nodiscard]] std::size_t size() const noexcept { return blocks_.size(); }
    [[nodiscard]] const Block& operator[](std::size_t block) const { return blocks_[block]; }
    [[nodiscard]] std::size_t slabs() const noexcept { return first_body_.size() - 1; }
    /// Bodies (places in `bodies`) of a slab, ascending.
    [[nodiscard]] std::span<const std::uint32_t> bodies_of(std::size_t slab) const {
        return std::span(bodies_).subspan(first_body_[slab], first_body_[slab + 1] - first_body_[slab]);
    }
    /// Manifolds of a block, ascending.
    [[nodiscard]] std::span<const int> manifolds_of(std::size_t block) const {
        return std::span(manifolds_)
            .subspan(first_manifold_[block], first_manifold_[block + 1] - first_manifold_[block]);
    }
    void set_contacts(std::size_t block, std::size_t first, std::size_t last) {
        blocks_[block].first = static_cast<std::uint32_t>(first);
        blocks_[block].last = static_cast<std::uint32_t>(last);
    }

    /// Calls visit(phase, block) for phases 0 to count: for every block in the order above, or, where of_bodies(phase), for
    /// every slab, as a block of that slab alone. To the bodies of a slab all of that is done in this order, so the result is
    /// that of one thread; no thread waits for the end of a phase, only for what shares a slab with its block.
    template <typename OfBodies, typename Visit>
    void run(Crew& crew, std::uint32_t count, OfBodies of_bodies, Visit visit) {
        if (crew.size() == 1 || blocks_.size() == 1) {
            for (std::uint32_t p = 0; p < count; ++p)
                for (std::size_t b = 0; b < blocks_in(of_bodies(p)); ++b) visit(p, blocks_[b]);
            return;
        }
        for (std::size_t s = 0; s < slabs(); ++s) done_[s].value.store(0, std::memory_order_relaxed);
        std::size_t sum = 0;
        for (std::uint32_t p = 0; p < count; ++p) sum += blocks_in(of_bodies(p));
        std::atomic<std::size_t> next = 0;
        // Taken in order: what a taken block waits for has been taken, too.
        crew.work([&](int) {
            Phase phase;
            for (std::size_t at; (at = next.fetch_add(1, std::memory_order_relaxed)) < sum;) {
                while (at >= phase.first + blocks_in(of_bodies(phase.number)))
                    pass(phase, of_bodies(phase.number));
                const Block& block = blocks_[at - phase.first];
                const bool bodies = of_bodies(phase.number);
                begin(block, phase, bodies);
                visit(phase.number, block);
                end(block, phase, bodies);
            }
        });
    }

private:
    struct alignas(64) Done {
        std::atomic<std::uint32_t> value = 0;  // blocks of a slab, in all phases
    };
    struct Phase {
        std::uint32_t number = 0, of_contacts = 0, of_bodies = 0;  // phases before it
        std::size_t first = 0;                                     // blocks in these
    };
    // The interiors come first: one a slab.
    [[nodiscard]] std::size_t blocks_in(bool of_bodies) const noexcept {
        return of_bodies ? slabs() : blocks_.size();
    }
    void pass(Phase& phase, bool of_bodies) const noexcept {
        phase.first += blocks_in(of_bodies);
        ++phase.number, ++(of_bodies ? phase.of_bodies : phase.of_contacts);
    }
    [[nodiscard]] std::uint32_t turn_of(const Block& block, std::uint32_t slab, const Phase& phase,
                                        bool of_bodies) const;
    void begin(const Block& block, const Phase& phase, bool of_bodies) const;
    void end(const Block& block, const Phase& phase, bool of_bodies);
    void set_slabs(std::span<const Body> bodies, std::span<const int> manifolds,
                   const std::vector<Manifold>& all, const std::vector<int>& local);
    /// Block of the contacts between a slab and the next.
    [[nodiscard]] std::size_t interface_after(std::size_t slab) const noexcept {
        return slabs() + (slab % 2 == 0 ? slab / 2 : slabs() / 2 + slab / 2);
    }
    void add_block(std::uint32_t slab, std::uint32_t slabs);

    std::vector<Block> blocks_;
    std::vector<std::uint32_t> slab_of_, bodies_, first_body_;
    std::vector<int> manifolds_;
    std::vector<std::uint32_t> first_manifold_, block_of_;
    std::array<Done, kMostSlabs> done_;
    std::array<std::uint32_t, kMostSlabs> blocks_of_{};  // of each slab, in a sweep
};

}  // namespace sim
