#pragma once
#include <cstdint>
#include <vector>

#include "shared/columns.h"
#include "sim/distributed_world.h"

namespace sim {

/// Groups of moving bodies that have to stay on one worker, because constraints join them directly or through
/// others. Ascending, by first bodies. Bodies added later are included; bodies that do not move are not.
[[nodiscard]] std::vector<std::vector<int>> joined_lots(const WorldScene& scene);

/// A worker (0 to workers - 1) per lot, by the lots' places: recursive coordinate bisection of columns into
/// about equal numbers of bodies, so that neighbours share a worker and no stack is cut.
[[nodiscard]] std::vector<int> first_owners(const Columns& columns, const std::vector<std::vector<int>>& lots,
                                            const std::vector<Eigen::Vector3d>& places, int workers);

}  // namespace sim
