#pragma once
#include <cstdint>
#include <vector>

#include "sim/distributed_world.h"

namespace sim {

/// Bodies that have to stay on one worker: joined by constraints, directly or through others; both move.
/// Ascending, by first bodies. Bodies that do not move are in none. With the bodies to come.
[[nodiscard]] std::vector<std::vector<int>> joined_lots(const WorldScene& scene);

/// A worker (0 to workers - 1) for each lot: recursive coordinate bisection of the places at the start into
/// equal numbers of bodies, so that neighbours share a worker.
[[nodiscard]] std::vector<int> first_owners(const WorldScene& scene,
                                            const std::vector<std::vector<int>>& lots, int workers);

}  // namespace sim
