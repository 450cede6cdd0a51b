#pragma once
#include <cstdint>
#include <vector>

#include "sim/distributed_world.h"

namespace sim {

/// Groups of moving bodies that have to stay on one worker, because constraints join them directly or through
/// others. Ascending, by first bodies. Bodies added later are included; bodies that do not move are not.
[[nodiscard]] std::vector<std::vector<int>> joined_lots(const WorldScene& scene);

/// A worker (0 to workers - 1) per lot: recursive coordinate bisection of the first positions into equal
/// numbers of bodies, so that neighbours share a worker.
[[nodiscard]] std::vector<int> first_owners(const WorldScene& scene,
                                            const std::vector<std::vector<int>>& lots, int workers);

}  // namespace sim
