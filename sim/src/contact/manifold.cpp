#include "contact/manifold.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr float kFar = 1e30f;

// Place of the largest of `count` scores (eight at a time) above `least`, -1 if none; the first of equals.
template <typename Score>
int best(std::size_t count, float least, Score score) {
    Lanes top = lanes_of(least);
    LaneMask place = LaneMask{} - 1, at = {0, 1, 2, 3, 4, 5, 6, 7};
    for (std::size_t i = 0; i < count; i += kLanes, at += kLanes) {
        const Lanes value = score(i);
        const LaneMask more = value > top;
        top = more ? value : top;
        place = more ? at : place;
    }
    int found = -1;
    float most = least;
    for (int lane = 0; lane < kLanes; ++lane) {
        if (place[lane] < 0 || top[lane] < most || (top[lane] == most && place[lane] > found)) continue;
        most = top[lane], found = place[lane];
    }
    return found;
}

Lanes largest(Lanes a, Lanes b) {
    return a > b ? a : b;
}

}  // namespace

void PointChooser::load(const std::vector<ContactCandidate>& candidates, const Manifold* before) {
    count_ = candidates.size();
    const std::size_t padded = (count_ + kLanes - 1) / kLanes * kLanes;
    for (LaneArray* array : {&separation_, &closest_, &favour_, &x_, &y_}) array->resize(padded);
    for (std::size_t i = 0; i < padded; ++i) {
        separation_.data()[i] = closest_.data()[i] = kFar;
        favour_.data()[i] = 1;
        if (i >= count_) continue;
        separation_.data()[i] = candidates[i].separation;
        closest_.data()[i] = candidates[i].closest;
        for (int j = 0; before && j < before->count; ++j)
            if (before->points[static_cast<std::size_t>(j)].feature == candidates[i].feature)
                favour_.data()[i] = 1.2f;
    }
}

// Of those that come to separations up to `out`.
int PointChooser::deepest(float out, float advantage) const {
    return best(count_, -kFar, [&](std::size_t i) {
        const Lanes favour = load_lanes(favour_.data() + i), closest = load_lanes(closest_.data() + i);
        const Lanes depth =
            (favour > 1 ? lanes_of(advantage) : lanes_of(0)) - load_lanes(separation_.data() + i);
        return closest > out ? lanes_of(-kFar) : depth;
    });
}

void PointChooser::spread(const std::vector<ContactCandidate>& candidates, int first) {
    const ContactCandidate& centre = candidates[static_cast<std::size_t>(first)];
    const Eigen::Vector3f x = centre.normal.unitOrthogonal(), y = centre.normal.cross(x);
    for (std::size_t i = 0; i < separation_.size(); ++i) {
        const Eigen::Vector3f d = candidates[std::min(i, count_ - 1)].arm_a - centre.arm_a;
        x_.data()[i] = d.dot(x);
        y_.data()[i] = d.dot(y);
    }
}

// The one that adds most length or area to the `count` chosen, of those that come to separations up to `out`; -1 if none
// adds more than `apart` of width.
int PointChooser::next(int count, float out, float apart) const {
    auto among = [&](std::size_t i, Lanes gain) {
        return load_lanes(closest_.data() + i) > out ? lanes_of(0) : load_lanes(favour_.data() + i) * gain;
    };
    auto area = [&](std::size_t i, Spot from, Spot to) {
        return (to.x - from.x) * (load_lanes(y_.data() + i) - from.y) -
               (to.y - from.y) * (load_lanes(x_.data() + i) - from.x);
    };
    if (count == 1)
        return best(count_, apart * apart, [&](std::size_t i) {
            const Lanes x = load_lanes(x_.data() + i), y = load_lanes(y_.data() + i);
            return among(i, load_lanes(favour_.data() + i) * (x * x + y * y));
        });
    const float thin = apart * std::hypot(second_.x, second_.y);
    if (count == 2)
        return best(count_, thin, [&](std::size_t i) {
            const Lanes a = area(i, {0, 0}, second_);
            return among(i, largest(a, -a));
        });
    // Area beyond each edge of the triangle (0, second, third).
    const float side = second_.x * third_.y - second_.y * third_.x > 0 ? -1.f : 1.f;
    return best(count_, thin, [&](std::size_t i) {
        return among(i, largest(largest(area(i, {0, 0}, second_) * side, area(i, second_, third_) * side),
                                area(i, third_, {0, 0}) * side));
    });
}

int PointChooser::choose(const std::vector<ContactCandidate>& candidates, float tolerance,
                         const Manifold* before, std::array<int, kManifoldPoints>& chosen) {
    if (candidates.empty()) return 0;
    load(candidates, before);
    const float least = std::ranges::min_element(candidates, {}, &ContactCandidate::closest)->closest;
    chosen[0] = deepest(reach(least, tolerance), tolerance / 8);
    if (count_ == 1 || chosen[0] < 0) return chosen[0] < 0 ? 0 : 1;
    const float level = std::clamp(candidates[static_cast<std::size_t>(chosen[0])].closest, 0.f,
                                   std::max(least + tolerance / 8, 0.f));
    spread(candidates, chosen[0]);
    int count = 1;
    for (const float out : {level + tolerance / 16, level + tolerance})
        while (count < kManifoldPoints) {
            const int found = next(count, out, tolerance / 2);
            if (found < 0) break;
            const Spot spot{x_.data()[found], y_.data()[found]};
            if (count == 1) second_ = spot;
            if (count == 2) third_ = spot;
            chosen[static_cast<std::size_t>(count++)] = found;
        }
    return count;
}

void take_impulses(const Manifold& before, float reach, Manifold& manifold) {
    std::array<bool, kManifoldPoints> used{}, matched{};
    auto take = [&](int i, int j) {
        ManifoldPoint& to = manifold.points[static_cast<std::size_t>(i)];
        const ManifoldPoint& from = before.points[static_cast<std::size_t>(j)];
        to.normal_impulse = from.normal_impulse;
        to.friction_impulse = from.friction_impulse;
        used[static_cast<std::size_t>(j)] = matched[static_cast<std::size_t>(i)] = true;
    };
    for (int i = 0; i < manifold.count; ++i)
        for (int j = 0; j < before.count; ++j)
            if (manifold.points[static_cast<std::size_t>(i)].feature ==
                before.points[static_cast<std::size_t>(j)].feature)
                take(i, j);
    for (int i = 0; i < manifold.count; ++i) {
        if (matched[static_cast<std::size_t>(i)]) continue;
        int nearest = -1;
        float distance = reach * reach;
        for (int j = 0; j < before.count; ++j) {
            if (used[static_cast<std::size_t>(j)]) continue;
            const float d = (manifold.points[static_cast<std::size_t>(i)].arm_a -
                             before.points[static_cast<std::size_t>(j)].arm_a)
                                .squaredNorm();
            if (d < distance) distance = d, nearest = j;
        }
        if (nearest >= 0) take(i, nearest);
    }
}

}  // namespace sim
