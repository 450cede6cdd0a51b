#include "solver/island_blocks.h"

#include <cmath>

namespace sim {
namespace {

// Of a slab, in mean diameters: the least of these beyond which no contact reaches, or the last.
constexpr std::array kThickness{1.25, 1.5, 1.75, 2.};
constexpr double kLonger = 1.1;  // than the axis before it, so much an axis has to be

// Its bodies' places in the island, -1 for what does not move.
std::pair<int, int> bodies_in(const Manifold& manifold, const std::vector<int>& local) {
    const auto place = [&](int id) { return id < kFirstPlane ? local[static_cast<std::size_t>(id)] : -1; };
    return {place(manifold.a), place(manifold.b)};
}

}  // namespace

void IslandBlocks::set_slabs(std::span<const Body> bodies, std::span<const int> manifolds,
                             const std::vector<Manifold>& all, const std::vector<int>& local) {
    slab_of_.assign(bodies.size(), 0);
    std::size_t slabs = 1;
    if (bodies.size() >= kLeastDivided) {
        Eigen::Vector3d low = bodies.front().place, high = low;
        double sum = 0;
        for (const Body& body : bodies) {
            low = low.cwiseMin(body.place), high = high.cwiseMax(body.place);
            sum += body.diameter;
        }
        const Eigen::Vector3d length = high - low;
        int axis = 0;
        for (int k = 1; k < 3; ++k)
            if (length[k] > kLonger * length[axis]) axis = k;
        const double diameter = sum / static_cast<double>(bodies.size());
        double furthest = 0;
        for (const int m : manifolds) {
            const auto [a, b] = bodies_in(all[static_cast<std::size_t>(m)], local);
            if (a >= 0 && b >= 0)
                furthest = std::max(furthest, std::abs(bodies[static_cast<std::size_t>(a)].place[axis] -
                                                       bodies[static_cast<std::size_t>(b)].place[axis]));
        }
        const auto enough =
            std::ranges::find_if(kThickness, [&](double share) { return share * diameter > furthest; });
        const double thickness =
            std::max((enough == kThickness.end() ? kThickness.back() : *enough) * diameter,
                     length[axis] / static_cast<double>(kMostSlabs - 1));
        const double first = std::floor(low[axis] / thickness);
        for (std::size_t i = 0; i < bodies.size(); ++i) {
            const double at = std::floor(bodies[i].place[axis] / thickness) - first;
            slab_of_[i] =
                static_cast<std::uint32_t>(std::clamp(at, 0.0, static_cast<double>(kMostSlabs - 1)));
            slabs = std::max(slabs, std::size_t{slab_of_[i]} + 1);
        }
    }
    first_body_.assign(slabs + 1, 0);
    for (const std::uint32_t slab : slab_of_) ++first_body_[slab + 1];
    for (std::size_t s = 0; s < slabs; ++s) first_body_[s + 1] += first_body_[s];
    bodies_.resize(bodies.size());
    std::array<std::uint32_t, kMostSlabs> next{};
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        const std::uint32_t slab = slab_of_[i];
        bodies_[first_body_[slab] + next[slab]++] = static_cast<std::uint32_t>(i);
    }
}

void IslandBlocks::add_block(std::uint32_t slab, std::uint32_t slabs) {
    Block block;
    block.slab = slab, block.slabs = slabs;
    block.before = blocks_of_[slab]++;
    if (slabs == 2) block.before_next = blocks_of_[slab + 1]++;
    blocks_.push_back(block);
}

void IslandBlocks::divide(Crew& crew, std::span<const Body> bodies, std::span<const int> manifolds,
                          const std::vector<Manifold>& all, const std::vector<int>& local) {
    set_slabs(bodies, manifolds, all, local);
    const auto count = static_cast<std::uint32_t>(slabs());
    blocks_.clear();
    blocks_of_.fill(0);
    for (std::uint32_t s = 0; s < count; ++s) add_block(s, 1);
    for (const std::uint32_t odd : {0u, 1u})
        for (std::uint32_t s = odd; s + 1 < count; s += 2) add_block(s, 2);
    if (count > 2) {
        // Every slab's last, whatever it touches.
        blocks_.emplace_back().slabs = count;
        for (std::uint32_t s = 0; s < count; ++s) ++blocks_of_[s];
    }
    const auto block_of = [&](const Manifold& m) -> std::uint32_t {
        const auto [first, second] = bodies_in(m, local);
        const auto slab = [this](int body) {
            return body < 0 ? -1 : static_cast<int>(slab_of_[static_cast<std::size_t>(body)]);
        };
        const int a = slab(first), b = slab(second);
        const int low = a < 0 ? b : b < 0 ? a : std::min(a, b), high = std::max(a, b);
        const auto from = static_cast<std::uint32_t>(std::max(low, 0));
        if (low == high) return from;
        if (high > low + 1) return static_cast<std::uint32_t>(blocks_.size()) - 1;
        return static_cast<std::uint32_t>(interface_after(from));
    };
    first_manifold_.assign(blocks_.size() + 1, 0);
    block_of_.resize(manifolds.size());
    crew.each(manifolds.size(), 128, [&](int, std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i)
            block_of_[i] = block_of(all[static_cast<std::size_t>(manifolds[i])]);
    });
    for (const std::uint32_t block : block_of_) ++first_manifold_[block + 1];
    if (count > 2 && first_manifold_.back() == 0) {
        blocks_.pop_back(), first_manifold_.pop_back();
        for (std::uint32_t s = 0; s < count; ++s) --blocks_of_[s];
    }
    for (std::size_t b = 0; b < blocks_.size(); ++b) first_manifold_[b + 1] += first_manifold_[b];
    manifolds_.resize(manifolds.size());
    std::array<std::uint32_t, 2 * kMostSlabs> next{};
    for (std::size_t i = 0; i < manifolds.size(); ++i)
        manifolds_[first_manifold_[block_of_[i]] + next[block_of_[i]]++] = manifolds[i];
}

// Blocks of a slab that are done when this one's turn comes.
std::uint32_t IslandBlocks::turn_of(const Block& block, std::uint32_t slab, const Phase& phase,
                                    bool of_bodies) const {
    const std::uint32_t in_all = blocks_of_[slab];
    const std::uint32_t before = of_bodies            ? 0
                                 : block.slabs > 2    ? in_all - 1
                                 : slab == block.slab ? block.before
                                                      : block.before_next;
    return phase.of_contacts * in_all + phase.of_bodies + before;
}

void IslandBlocks::begin(const Block& block, const Phase& phase, bool of_bodies) const {
    for (std::uint32_t s = block.slab; s < block.slab + block.slabs; ++s)
        for (ShortWait wait;
             done_[s].value.load(std::memory_order_acquire) != turn_of(block, s, phase, of_bodies);)
            (void)wait.again();
}

void IslandBlocks::end(const Block& block, const Phase& phase, bool of_bodies) {
    for (std::uint32_t s = block.slab; s < block.slab + block.slabs; ++s)
        done_[s].value.store(turn_of(block, s, phase, of_bodies) + 1, std::memory_order_release);
}

}  // namespace sim
