#pragma once
#include <span>
#include <vector>

#include "sim/distributed_world.h"
#include "world/shared_world.h"

namespace sim {

// A structure is a set of bodies that one worker should own. If several workers hold a pile, it keeps swaying
// by some centimetres a second. A heap may do that, but not what has to stand.

/// Most bodies of a structure: 256 if at least three quarters of them are flat and upright, as in a wall;
/// else 64.
constexpr std::size_t kMostInStructure = 64, kMostStanding = 256;

/// Structures among an owner's bodies: slow bodies side by side or on each other. Other owners' bodies that
/// touch a structure must be at most a quarter as many.
///
/// `size`: mean diameter of bodies [m]. Slow: slower than a quarter of sqrt(g size), the speed of a fall by
/// half the size. Side by side: boxes around the bodies' rest shapes, along the world's axes, are at most 2 %
/// of the size apart. As of the end of the world's last step. Each structure has two bodies or more,
/// ascending. Without gravity there are none. O(n log n), unless many bodies lie behind each other along x.
/// `bodies` exist and move.
[[nodiscard]] std::vector<std::vector<int>> structures(const SharedWorld& world, std::span<const int> bodies,
                                                       double size);

/// A body of another owner, in its present state as far as it is known.
struct OthersBody {
    int body;
    bool asleep;
    WorldBodyState state;
};
/// Structures that flat bodies (is_flat) are about to build, so that each has one owner before its bodies
/// meet. Bodies belong together if they come near each other within a time [s], as they move now: across
/// gravity at the same time, along gravity at any times, since the lower one may be stopped. Near: at most 10
/// % of the size apart; across gravity 2 % if both are slow. Bodies of `others` join structures, but are not
/// in the result. Otherwise as structures().
[[nodiscard]] std::vector<std::vector<int>> flat_structures(const SharedWorld& world,
                                                            std::span<const int> bodies, double size,
                                                            double within_s,
                                                            std::span<const OthersBody> others = {});

/// All bodies of a scene before their first step, with those that events add.
[[nodiscard]] SharedWorld with_later(const WorldScene& scene);
/// Finds structures in a run of a scene. It looks ahead for so many seconds (structure_outlook).
class StructureFinder {
public:
    StructureFinder(const WorldScene& scene, double size, double within_s);
    /// Flat structures, with those that events complete, by the first places of all bodies. Such a structure
    /// counts until all its bodies exist, unless one of them is added at the place of another one, as bodies are
    /// that are poured in.
    [[nodiscard]] std::vector<std::vector<int>> flat(const SharedWorld& world, std::span<const int> bodies,
                                                     std::span<const OthersBody> others = {}) const;
    /// These and structures().
    [[nodiscard]] std::vector<std::vector<int>> all(const SharedWorld& world, std::span<const int> bodies,
                                                    std::span<const OthersBody> others = {}) const;

private:
    double size_, within_s_;
    std::vector<std::vector<int>> planned_;  // that events complete
};
/// Whether something can stand on a side of the body, as on boxes and cylinders, but not on balls.
[[nodiscard]] bool is_flat(const WorldBody& body);
/// The time to look ahead for flat structures [s]: workers may be so far apart, and a sale takes some steps.
[[nodiscard]] double structure_outlook(int bound, double dt);
/// The application asks for a body of a structure (Gather) again after so many steps. The request is void by
/// then.
[[nodiscard]] std::uint64_t gather_patience(int bound);

/// Factors by which bodies that are shared out may differ.
constexpr double kMostUnlikeMass = 4, kMostUnlikeLength = 3;
/// Whether groups of tied bodies can be shared out among workers: groups in no structure must resemble each
/// other and all others, by the heaviest and the longest body of each. If not, one worker owns all bodies.
/// The reason: a body is held up by states that are some steps old. The heavier it is than the bodies that
/// hold it, or the more workers own these, the larger is the late answer, until it grows from step to step.
/// `world` has all bodies of the groups.
[[nodiscard]] bool are_alike(const SharedWorld& world, const std::vector<std::vector<int>>& groups,
                             const std::vector<std::vector<int>>& structures);

/// For each group: the first group that it shares a structure with, directly or through others, or itself.
[[nodiscard]] std::vector<int> joined_by(const std::vector<std::vector<int>>& structures,
                                         const std::vector<std::vector<int>>& groups);

}  // namespace sim
