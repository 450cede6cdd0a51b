#pragma once
#include "world/broad_phase.h"
#include "world/island_solver.h"

namespace sim {

/// Finds the contacts of a step: broad phase, samples against implicit surfaces both ways, manifolds,
/// impulses of the step before; wakes sleepers that are touched.
class WorldContacts {
public:
    /// `joined`: pairs (a < b, ascending) that a constraint joins; they do not collide.
    /// here: ids of those that take part, ascending. among_ghosts: of an own and a foreign body only the
    /// pairs of which the lower number is own, and no two foreign ones.
    void find(const WorldSettings& settings, const std::vector<WorldPlane>& planes,
              const std::vector<std::pair<int, int>>& joined, std::vector<MovingBody>& bodies,
              const std::vector<int>& here, bool among_ghosts);

    std::vector<Manifold>& manifolds() noexcept { return manifolds_; }  ///< of the last step
    [[nodiscard]] const std::vector<Manifold>& manifolds() const noexcept { return manifolds_; }
    [[nodiscard]] int pairs() const noexcept { return pairs_; }  ///< tested in the last step
    [[nodiscard]] std::uint64_t fallbacks() const noexcept { return finder_.fallbacks(); }

private:
    struct Speed {
        double surface;  // of the surface about the centre, at most [m/s]
        double grown;    // how far any point may come in the step, and the slop [m]
    };
    bool find_once(const WorldSettings& settings, const std::vector<WorldPlane>& planes,
                   const std::vector<std::pair<int, int>>& joined, std::vector<MovingBody>& bodies,
                   const std::vector<int>& here);
    [[nodiscard]] bool resolved_here(const std::vector<MovingBody>& bodies, int i, int j) const;
    void meet_pair(const WorldSettings& settings, std::vector<MovingBody>& bodies, int i, int j);
    void meet_planes(const WorldSettings& settings, const std::vector<WorldPlane>& planes,
                     const MovingBody& body, int i);
    void meet(const MovingBody& a, const MovingBody& b, float margin, Manifold& manifold);
    void meet_plane(const MovingBody& a, const WorldPlane& plane, float height, float margin,
                    Manifold& manifold);
    void part(const PosedBody& a, const PosedBody& b, const Eigen::Vector3f& between, const Manifold* before,
              Manifold& manifold);
    void fill(float size, const Eigen::Vector3f& between, Manifold& manifold);
    const Manifold* last(std::uint64_t key);

    BroadPhase broad_;
    SampleFinder finder_;
    std::vector<SampleContact> found_;
    std::vector<ContactCandidate> candidates_;
    PointChooser chooser_;
    std::vector<Speed> speeds_;                 // of each body
    std::vector<Manifold> manifolds_, before_;  // by ascending keys
    std::size_t next_before_ = 0;               // first of before_ whose key has not been passed
    int pairs_ = 0;
    bool woke_ = false, among_ghosts_ = false;
};

/// How far a body's contacts may begin beyond its surface in the next step [m].
[[nodiscard]] double contact_reach(const MovingBody& body, const WorldSettings& settings);

/// Wakes every body of the group that fell asleep with this one.
void wake_group(std::vector<MovingBody>& bodies, int body);

}  // namespace sim
