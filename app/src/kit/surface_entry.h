#pragma once
#include <algorithm>
#include <cmath>

namespace app {

// Where a path comes into a surface. The path is given by its signed distance to the surface, distance(x)
// [m, positive outside], over any parameter x of the path (time, way, share of a piece): a body at rest and a
// plane differ in the distance alone.

/// One step of a walk along a path: from parameter `from`, where the distance is `before`, to `to`.
struct WalkStep {
    double from, to, before, now;
    [[nodiscard]] bool enters() const { return before > 0 && now <= 0; }
    [[nodiscard]] bool leaves() const { return before <= 0 && now > 0; }
};

/// Walks from `begin`, where the distance is `before`, to `end` and calls visit(WalkStep) for each step; returns
/// the distance at the end. Far from the surface the distance itself is a safe step, and half of it allows for
/// its error; no step is shorter than 0.5 mm of way, so only a dip shorter than that can be missed (of more than
/// 10 m of way, than 1/20000 of it, which bounds the cost of absurd paths). `fastest`: the path covers at most
/// that much way per unit of the parameter [m].
template <class Distance, class Visit>
double walk(double begin, double end, double before, double fastest, const Distance& distance,
            const Visit& visit) {
    constexpr double kShortestStepM = 0.0005, kMostSteps = 20000;
    const double shortest_m = std::max(kShortestStepM, fastest * (end - begin) / kMostSteps);
    for (double x = begin; x < end;) {
        const double next = std::min(end, x + std::max(shortest_m, 0.5 * std::abs(before)) / fastest);
        const double now = distance(next);
        visit(WalkStep{x, next, before, now});
        x = next;
        before = now;
    }
    return before;
}

/// The parameter at which the distance falls to 0 between `outside` (above 0) and `inside` (0 or below), by
/// bisection to `tolerance` or 60 halvings; inside by at most that.
template <class Distance>
double entry_between(double outside, double inside, double tolerance, const Distance& distance) {
    constexpr int kMostHalvings = 60;
    for (int i = 0; i < kMostHalvings && inside - outside > tolerance; ++i) {
        const double middle = 0.5 * (outside + inside);
        (distance(middle) > 0 ? outside : inside) = middle;
    }
    return inside;
}

}  // namespace app
