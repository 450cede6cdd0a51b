#include "contact/broad_phase.h"

#include <algorithm>

namespace sim {
namespace {

constexpr std::size_t kLeastShared = 256;  // boxes that are worth sharing out

}  // namespace

const std::vector<std::pair<int, int>>& BroadPhase::find(Crew& crew) {
    pairs_.clear();
    if (boxes_.empty()) return pairs_;
    Eigen::Vector3d low = boxes_.front().low, high = low;
    for (const Box& box : boxes_) low = low.cwiseMin(box.low), high = high.cwiseMax(box.low);
    (high - low).maxCoeff(&axis_);
    std::sort(boxes_.begin(), boxes_.end(), [axis = axis_](const Box& a, const Box& b) {
        return a.low[axis] != b.low[axis] ? a.low[axis] < b.low[axis] : a.body < b.body;
    });
    const std::size_t parts = boxes_.size() < kLeastShared ? 1 : static_cast<std::size_t>(crew.size());
    if (parts == 1) {
        find(0, boxes_.size(), pairs_);
        return pairs_;
    }
    parts_.resize(std::max(parts, parts_.size()));
    crew.each(parts, 1, [&](int, std::size_t first, std::size_t last) {
        for (std::size_t p = first; p < last; ++p) {
            parts_[p].clear();
            find(p * boxes_.size() / parts, (p + 1) * boxes_.size() / parts, parts_[p]);
        }
    });
    for (std::size_t p = 0; p < parts; ++p) {
        merged_.resize(pairs_.size() + parts_[p].size());
        std::merge(pairs_.begin(), pairs_.end(), parts_[p].begin(), parts_[p].end(), merged_.begin());
        std::swap(pairs_, merged_);
    }
    return pairs_;
}

// Pairs of these with later ones, ascending.
void BroadPhase::find(std::size_t first, std::size_t last, std::vector<std::pair<int, int>>& pairs) const {
    const int second = (axis_ + 1) % 3, third = (axis_ + 2) % 3;
    for (std::size_t i = first; i < last; ++i) {
        const Box& a = boxes_[i];
        for (std::size_t j = i + 1; j < boxes_.size() && boxes_[j].low[axis_] <= a.high[axis_]; ++j) {
            const Box& b = boxes_[j];
            if (a.low[second] > b.high[second] || b.low[second] > a.high[second] ||
                a.low[third] > b.high[third] || b.low[third] > a.high[third] || (!a.moves && !b.moves))
                continue;
            pairs.emplace_back(std::min(a.body, b.body), std::max(a.body, b.body));
        }
    }
    std::sort(pairs.begin(), pairs.end());
}

}  // namespace sim
