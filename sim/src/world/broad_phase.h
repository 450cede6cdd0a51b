#pragma once
#include <Eigen/Core>
#include <utility>
#include <vector>

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
    const std::vector<std::pair<int, int>>& find();

private:
    std::vector<Box> boxes_;
    std::vector<std::pair<int, int>> pairs_;
};

}  // namespace sim
