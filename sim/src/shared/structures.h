#pragma once
#include <span>
#include <vector>

#include "sim/distributed_world.h"
#include "world/shared_world.h"

namespace sim {

/// Most bodies of a structure: 256 if at least three quarters of them are flat and upright, as in a wall, else 64.
constexpr std::size_t kMostInStructure = 64, kMostStanding = 256;

/// Structures among an owner's bodies: bodies side by side or on each other that are slow, touched by at most
/// a quarter as many of other owners' bodies. They stay on one worker: what several hold keeps swaying by some centimetres a
/// second, which a heap may and what has to stand may not.
///
/// `size`: mean diameter of bodies [m]. Slow: by less than a quarter of sqrt(g size), the speed of a fall by half of it. Side
/// by side: boxes around the bodies' rest shapes, along the world's axes, are at most 2 % of it apart. As of the end of the
/// world's last step. Each has two bodies or more, ascending; without gravity there are none. O(n log n) but for bodies one
/// behind the other along x. `bodies` move and are there.
[[nodiscard]] std::vector<std::vector<int>> structures(const SharedWorld& world, std::span<const int> bodies,
                                                       double size);

/// A body of another owner, where it is by now as far as is known.
struct OthersBody {
    int body;
    bool asleep;
    WorldBodyState state;
};
/// What flat bodies (is_flat) build, so that it has one owner before they meet: those belong together that come near each
/// other within a time [s], as they move now: across gravity at the same time, along gravity whenever, as who falls first may
/// be stopped. Near: at most 10 % of the size apart, across gravity 2 % if both are slow. `others` count, and are not in the
/// result. The rest as for structures.
[[nodiscard]] std::vector<std::vector<int>> flat_structures(const SharedWorld& world,
                                                            std::span<const int> bodies, double size,
                                                            double within_s,
                                                            std::span<const OthersBody> others = {});

/// All bodies of a scene before their first step, also those to come.
[[nodiscard]] SharedWorld with_later(const WorldScene& scene);
/// Flat structures that events complete, by where all bodies are at first: those with bodies to come, none of them at the place
/// of another, as of bodies that are poured.
class PlannedStructures {
public:
    PlannedStructures(const WorldScene& scene, double size, double within_s);
    /// Adds those of which some bodies have not come to a world of so many.
    void add_unfinished(int bodies, std::vector<std::vector<int>>& structures) const;

private:
    std::vector<std::vector<int>> planned_;
};
/// Whether a body has sides on which something can stand, as boxes and cylinders have, and balls have not.
[[nodiscard]] bool is_flat(const WorldBody& body);
/// What a run of this bound takes as within_s [s]: workers may be so far apart, and a body takes some steps to change owners.
[[nodiscard]] double structure_outlook(int bound, double dt);
/// Steps after which the application asks again for bodies of a structure (Gather); who was asked forgets it by then.
[[nodiscard]] std::uint64_t gather_patience(int bound);

/// Factors by which bodies that are shared out may differ.
constexpr double kMostUnlikeMass = 4, kMostUnlikeLength = 3;
/// Whether lots that are in no structure are like each other and like those that are: by the heaviest and the longest body of each. Others are given to one
/// worker. A body is held up by what other workers told some steps ago; the heavier it is than what holds it, or the more
/// workers' bodies it lies on, the larger is the answer that comes late, until it grows from step to step. `world` has
/// all bodies of the lots.
[[nodiscard]] bool are_alike(const SharedWorld& world, const std::vector<std::vector<int>>& lots,
                             const std::vector<std::vector<int>>& structures);

/// Of each lot the first one that it shares a structure with, directly or through others; itself, if with none.
[[nodiscard]] std::vector<int> joined_by(const std::vector<std::vector<int>>& structures,
                                         const std::vector<std::vector<int>>& lots);

}  // namespace sim
