#pragma once
#include <span>
#include <utility>
#include <vector>

#include "messages/worker_messages.h"

namespace sim {

/// Bodies that may come near others' within so many steps have to be known there, in a run of this bound.
[[nodiscard]] constexpr int near_steps(int bound) {
    return bound + 2;
}
/// Largest radius of a ball around a body that is shared out with others, in mean lengths: that of a cube
/// three times as long (are_alike).
constexpr double kWidest = 2.6;

/// How far ahead the ways of bodies are estimated.
struct Outlook {
    double time = 0;     ///< [s]
    double dt = 0;       ///< for so long a body may move in any direction, as after a collision [s]
    double gravity = 0;  ///< [m/s^2]
};
/// A box that contains a ball on its way [m]. It is empty if the way is not finite or goes beyond
/// kFurthestReach.
[[nodiscard]] Eigen::AlignedBox3f box_of_way(const WorldBodyState& state, double radius,
                                             const Outlook& outlook);
/// The reach of boxes of ways, each with its body's speed [m/s]. Empty boxes are left out.
[[nodiscard]] Reach reach_of(std::span<const std::pair<Eigen::AlignedBox3f, float>> ways);
/// The reach of these bodies, whose radius is at most `radius` [m].
[[nodiscard]] Reach reach_of(const std::vector<WorldRecord>& bodies, double radius, const Outlook& outlook);
/// Whether a box overlaps a part of a reach in which there are bodies.
[[nodiscard]] bool meets(const Eigen::AlignedBox3f& box, const Reach& reach);

}  // namespace sim
