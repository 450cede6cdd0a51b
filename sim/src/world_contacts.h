#pragma once
#include "broad_phase.h"
#include "island_solver.h"

namespace sim {

/// Finds the contacts of a step: broad phase, samples against implicit surfaces both ways, manifolds,
/// impulses of the step before; wakes sleepers that are touched.
class WorldContacts {
public:
    /// `joined`: pairs (a < b, ascending) that a constraint joins; they do not collide.
    void find(const WorldSettings& settings, const std::vector<WorldPlane>& planes,
              const std::vector<std::pair<int, int>>& joined, std::vector<MovingBody>& bodies);

    std::vector<Manifold>& manifolds() noexcept { return manifolds_; }
    [[nodiscard]] int pairs() const noexcept { return pairs_; }
    [[nodiscard]] std::uint64_t fallbacks() const noexcept { return finder_.fallbacks(); }

private:
    bool find_once(const WorldSettings& settings, const std::vector<WorldPlane>& planes,
                   const std::vector<std::pair<int, int>>& joined, std::vector<MovingBody>& bodies);
    void meet(const WorldSettings& settings, const MovingBody& a, const MovingBody& b, const Manifold* before,
              Manifold& manifold);
    void meet_plane(const WorldSettings& settings, const MovingBody& a, const WorldPlane& plane,
                    const Manifold* before, Manifold& manifold);

    BroadPhase broad_;
    SampleFinder finder_;
    std::vector<SampleContact> found_;
    std::vector<ManifoldPoint> candidates_;
    std::vector<Manifold> manifolds_, before_;
    int pairs_ = 0;
};

/// Wakes every body of the group that fell asleep with this one.
void wake_group(std::vector<MovingBody>& bodies, int body);

}  // namespace sim
