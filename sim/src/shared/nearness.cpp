#include "shared/nearness.h"

#include <algorithm>
#include <cmath>

namespace sim {

Eigen::AlignedBox3f box_of_way(const WorldBodyState& state, double radius, const Outlook& outlook) {
    // One of two bodies may fall away from the other. Each box takes half of that distance.
    const double fall = outlook.gravity * outlook.time * outlook.time / 2,
                 around = radius + outlook.dt * state.velocity.norm() + fall / 2;
    const Eigen::Vector3d end = state.position + outlook.time * state.velocity;
    const Eigen::Array3d low = state.position.cwiseMin(end).array() - around,
                         high = state.position.cwiseMax(end).array() + around;
    if (!(low > -kFurthestReach).all() || !(high < kFurthestReach).all()) return {};
    return {low.cast<float>().matrix(), high.cast<float>().matrix()};
}

namespace {

constexpr int kParts = 8;  // into which a side is cut

struct Parts {
    int first, last;
};

// The parts of a side that a box touches.
Parts parts_of(const Eigen::AlignedBox3f& box, const Eigen::AlignedBox3f& all, Eigen::Index side) {
    const float length = std::max(all.sizes()[side], 1e-6F);
    const auto part = [&](float at) {
        return std::floor(static_cast<float>(kParts) * (at - all.min()[side]) / length);
    };
    const float low = part(box.min()[side]), high = part(box.max()[side]), last = kParts - 1;
    // A box that ends at the border lies in the last part.
    return {static_cast<int>(std::clamp(low, 0.F, last)), static_cast<int>(std::clamp(high, 0.F, last))};
}

std::uint64_t mask_of(const Eigen::AlignedBox3f& box, const Eigen::AlignedBox3f& all) {
    Eigen::Index shortest = 0;
    all.sizes().minCoeff(&shortest);
    const Parts a = parts_of(box, all, (shortest + 1) % 3), b = parts_of(box, all, (shortest + 2) % 3);
    std::uint64_t row = 0, mask = 0;
    for (int i = a.first; i <= a.last; ++i) row |= std::uint64_t{1} << i;
    for (int k = b.first; k <= b.last; ++k) mask |= row << (kParts * k);
    return mask;
}

}  // namespace

Reach reach_of(std::span<const std::pair<Eigen::AlignedBox3f, float>> ways) {
    Reach reach;
    for (const auto& [box, speed] : ways) {
        if (box.isEmpty()) continue;
        reach.box.extend(box);
        reach.speed = std::max(reach.speed, speed);
    }
    for (const auto& [box, speed] : ways)
        if (!box.isEmpty()) reach.parts |= mask_of(box, reach.box);
    return reach;
}

Reach reach_of(const std::vector<WorldRecord>& bodies, double radius, const Outlook& outlook) {
    std::vector<std::pair<Eigen::AlignedBox3f, float>> ways;
    for (const WorldRecord& record : bodies)
        ways.emplace_back(box_of_way(record.state, radius, outlook),
                          static_cast<float>(record.state.velocity.norm()));
    return reach_of(ways);
}

bool meets(const Eigen::AlignedBox3f& box, const Reach& reach) {
    return box.intersects(reach.box) && (mask_of(box, reach.box) & reach.parts) != 0;
}

}  // namespace sim
