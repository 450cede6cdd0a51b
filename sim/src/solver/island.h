#pragma once
#include <vector>

namespace sim {

/// Bodies joined by contacts or constraints in one step, in order of ids.
struct Island {
    std::vector<int> bodies;       ///< that move, ascending
    std::vector<int> manifolds;    ///< indices, ascending by (a, b)
    std::vector<int> constraints;  ///< indices, ascending
};

}  // namespace sim
