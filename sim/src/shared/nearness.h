#pragma once
#include <span>
#include <utility>
#include <vector>

#include "messages/worker_messages.h"

namespace sim {

/// Steps within which bodies have to be known that may come near others, in a run of this bound.
[[nodiscard]] constexpr int near_steps(int bound) {
    return bound + 2;
}
/// Radius of a ball about the longest body that is shared out with others, at most, in mean lengths (are_alike): of a cube three times
/// as long.
constexpr double kWidest = 2.6;

/// How bodies move on from where they are, for a while.
struct Outlook {
    double time = 0;     ///< [s]
    double dt = 0;       ///< so long they may go any way, as after a collision [s]
    double gravity = 0;  ///< [m/s^2]
};
/// A box that holds a ball on its way [m]; empty if that is not finite, or beyond kFurthestReach.
[[nodiscard]] Eigen::AlignedBox3f box_of_way(const WorldBodyState& state, double radius,
                                             const Outlook& outlook);
/// Of balls on their ways, with the speed of each [m/s]; empty boxes are left out.
[[nodiscard]] Reach reach_of(std::span<const std::pair<Eigen::AlignedBox3f, float>> ways);
/// Of these bodies, of at most this radius [m].
[[nodiscard]] Reach reach_of(const std::vector<WorldRecord>& bodies, double radius, const Outlook& outlook);
/// Whether a box has something in common with a part of a reach in which bodies are.
[[nodiscard]] bool meets(const Eigen::AlignedBox3f& box, const Reach& reach);

}  // namespace sim
