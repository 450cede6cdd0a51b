#include "world/broad_phase.h"

#include <algorithm>

namespace sim {

const std::vector<std::pair<int, int>>& BroadPhase::find() {
    pairs_.clear();
    if (boxes_.empty()) return pairs_;
    Eigen::Vector3d low = boxes_.front().low, high = low;
    for (const Box& box : boxes_) low = low.cwiseMin(box.low), high = high.cwiseMax(box.low);
    int axis = 0;
    (high - low).maxCoeff(&axis);
    const int second = (axis + 1) % 3, third = (axis + 2) % 3;
    std::sort(boxes_.begin(), boxes_.end(), [axis](const Box& a, const Box& b) {
        return a.low[axis] != b.low[axis] ? a.low[axis] < b.low[axis] : a.body < b.body;
    });
    for (std::size_t i = 0; i < boxes_.size(); ++i) {
        const Box& a = boxes_[i];
        for (std::size_t j = i + 1; j < boxes_.size() && boxes_[j].low[axis] <= a.high[axis]; ++j) {
            const Box& b = boxes_[j];
            if (a.low[second] > b.high[second] || b.low[second] > a.high[second] ||
                a.low[third] > b.high[third] || b.low[third] > a.high[third] || (!a.moves && !b.moves))
                continue;
            pairs_.emplace_back(std::min(a.body, b.body), std::max(a.body, b.body));
        }
    }
    std::sort(pairs_.begin(), pairs_.end());
    return pairs_;
}

}  // namespace sim
