#pragma once
#include <vector>

#include "shared/columns.h"
#include "sim/distributed_world.h"

namespace sim {

/// Groups of moving bodies that constraints tie together, directly or through others, with bodies that are
/// added later. A group has one owner. Bodies ascend, groups ascend by their first bodies.
[[nodiscard]] std::vector<std::vector<int>> tied_groups(const WorldScene& scene);

/// A worker (0 to workers - 1) for each group, by the groups' places: recursive coordinate bisection of
/// columns into about equal numbers of bodies, so that neighbours share a worker and no stack is cut.
[[nodiscard]] std::vector<int> first_owners(const Columns& columns,
                                            const std::vector<std::vector<int>>& groups,
                                            const std::vector<Eigen::Vector3d>& places, int workers);

}  // namespace sim
