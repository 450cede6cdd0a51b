#pragma once
#include <Eigen/Core>
#include <utility>
#include <vector>

#include "contact/crew.h"

namespace sim {

/// Pairs of axis-aligned boxes that overlap, by sort and sweep along the axis of the largest spread:
/// O(n log n + pairs along the axis).
class BroadPhase {
public:
    struct Box {
        Eigen::Vector3d low, high;
        int body;
        bool moves;  ///< pairs of two boxes that do not move are left out
    };
    std::vector<Box>& boxes() noexcept { return boxes_; }  ///< fill before find; any order

    /// Pairs (a < b), ascending.
    const std::vector<std::pair<int, int>>& find(Crew& crew);

private:
    void find(std::size_t first, std::size_t last, std::vector<std::pair<int, int>>& pairs) const;

    std::vector<Box> boxes_;
    int axis_ = 0;  // that boxes are swept along
    std::vector<std::vector<std::pair<int, int>>> parts_;
    std::vector<std::pair<int, int>> pairs_, merged_;
};

}  // namespace sim
