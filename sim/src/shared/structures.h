#pragma once
#include <span>
#include <vector>

#include "sim/world.h"

namespace sim {

/// Most bodies of a structure.
constexpr std::size_t kMostInStructure = 64;

/// Structures among an owner's bodies, for bounded pace: bodies side by side or on each other that are slow, kMostInStructure
/// at most, touched by at most a quarter as many of other owners' bodies. They stay on one worker: what several hold keeps swaying by some
/// centimetres a second, which a heap may and what has to stand may not.
///
/// `size`: mean diameter of bodies [m]. Slow: by less than a quarter of sqrt(g size), the speed of a fall by half of it. Side
/// by side: boxes around the bodies' rest shapes, along the world's axes, are at most 2 % of it apart. As of the end of the
/// world's last step. Each has two bodies or more, ascending. O(n log n) but for bodies one behind the other along x.
/// `bodies` move and are there.
[[nodiscard]] std::vector<std::vector<int>> structures(const World& world, std::span<const int> bodies,
                                                       double size);

/// Of each lot the first one that it shares a structure with, directly or through others; itself, if with none.
[[nodiscard]] std::vector<int> joined_by(const std::vector<std::vector<int>>& structures,
                                         const std::vector<std::vector<int>>& lots);

}  // namespace sim
