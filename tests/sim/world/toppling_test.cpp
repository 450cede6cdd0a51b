#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "world_bodies.h"

// Thin boxes that turn as they meet: an end that lands while the other one touches already, edges that slide along faces.

using namespace world_test;
using Eigen::Vector3d;

namespace {

/// Calls visit(place) for places on the edges of a box, its own axes. Edges are rounded: those of exponent 0.1 pass the half
/// extents at 0.95 of these.
template <typename Visit>
void each_edge_place(const Vector3d& half, Visit visit) {
    constexpr int kPlaces = 9;
    for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 4; ++side)
            for (int i = 0; i < kPlaces; ++i) {
                Vector3d at;
                at[axis] = -1 + 2.0 * i / (kPlaces - 1);
                at[(axis + 1) % 3] = side % 2 == 0 ? -1 : 1;
                at[(axis + 2) % 3] = side / 2 == 0 ? -1 : 1;
                visit(Vector3d(0.95 * half.cwiseProduct(at)));
            }
}

/// How deep a box's edges are in another, at most, as a share of the other's least half extent.
double depth_in(const sim::WorldBodyState& box, const Vector3d& half, const sim::WorldBodyState& other,
                const Vector3d& other_half) {
    double deepest = 0;
    each_edge_place(half, [&](const Vector3d& at) {
        const Vector3d place =
            other.orientation.conjugate() * (box.position + box.orientation * at - other.position);
        deepest = std::max(deepest, (other_half - place.cwiseAbs()).minCoeff());
    });
    return deepest / other_half.minCoeff();
}

/// How deep a box's edges are in the floor, at most [m].
double depth_in_floor(const sim::WorldBodyState& box, const Vector3d& half) {
    double deepest = 0;
    each_edge_place(half, [&](const Vector3d& at) {
        deepest = std::max(deepest, -(box.position + box.orientation * at).y());
    });
    return deepest;
}

// They sank into each other by all of their thickness, and lay so: each step took the edge of one a little further into the face
// of the next, as a blow that was over when they turned on.
TEST(Toppling, DominoesOfAnySizeDoNotSinkIntoEachOther) {
#ifdef MUSICWORLD_SANITIZED
    constexpr int kTrials = 1;  // ten seconds each
#else
    constexpr int kTrials = 12;
#endif
    Draw draw(11);
    for (int trial = 0; trial < kTrials; ++trial) {
        const double height = draw.scale(0.05, 1.5), thick = height * draw.between(0.08, 0.3),
                     gap = height * draw.between(0.2, 0.6);
        const Vector3d half(thick / 2, height / 2, height * draw.between(0.1, 0.4));
        sim::WorldDefinition d = on_floor();
        d.settings.dt = trial % 2 == 0 ? 1.0 / 60 : 1.0 / 120;
        const int dominoes = 3 + draw.below(4);
        for (int i = 0; i < dominoes; ++i)
            d.bodies.push_back(box({i * (thick + gap), height / 2, 0}, half, 500));
        d.bodies[0].velocity.x() = 0.4 * std::sqrt(9.81 * height);
        d.bodies[0].angular_velocity.z() = -2 * d.bodies[0].velocity.x() / height;
        sim::World world(d);
        double deepest = 0, last = 0;
        for (int step = 0; step < static_cast<int>(2.5 / d.settings.dt); ++step) {
            world.step();
            last = 0;
            for (int i = 0; i + 1 < dominoes; ++i)
                last = std::max({last, depth_in(world.state(i), half, world.state(i + 1), half),
                                 depth_in(world.state(i + 1), half, world.state(i), half)});
            deepest = std::max(deepest, last);
        }
        // A blow at one end of an edge lets the other end in by a tenth until it strikes, too, and little more each time.
        EXPECT_LT(deepest, 0.5) << trial << ", height " << height;
        EXPECT_LT(last, 0.25) << trial << ", height " << height;
    }
}

// The far end came into the floor by up to ten times its half thickness, as only what touched when the step began was held. Now,
// in the mean over tilts, it stays within the half thickness, of planks that move by more than that in a step, too: an end that a
// blow within the step turns down is held from the next one on, and of a side that lands four places are.
TEST(Toppling, PlanksThatSlapOnTheFloorStayOnIt) {
    struct Case {
        double length, rate, deepest;  // [m], [1/s], of the half thickness; in the mean
    };
    const Case cases[] = {{1, 30, 0.4},    {1, 60, 0.4},    {1, 120, 0.2},   {0.2, 30, 0.9},  {0.2, 60, 0.6},
                          {0.2, 120, 0.2}, {0.06, 30, 0.9}, {0.06, 60, 0.9}, {0.06, 120, 0.4}};
    for (const auto& [length, rate, bound] : cases) {
        const Vector3d half = length * Vector3d(0.5, 0.05, 0.15);
        const double tilts[] = {2, 5, 10, 20, 40, 60, 80};
        double sum = 0;
        for (const double tilt : tilts) {
            const double angle = tilt * std::numbers::pi / 180;
            sim::WorldDefinition d = on_floor();
            d.settings.dt = 1 / rate;
            d.bodies.push_back(box(
                {0, half.x() * std::sin(angle) + half.y() * std::cos(angle) + 0.1 * length, 0}, half, 500));
            d.bodies[0].world_from_body.rotate(Eigen::AngleAxisd(angle, Vector3d::UnitZ()));
            sim::World world(d);
            double deepest = 0;
            for (int step = 0; step < 3 * rate; ++step) {
                world.step();
                deepest = std::max(deepest, depth_in_floor(world.state(0), half));
            }
            sum += deepest / half.y();
            EXPECT_LT(depth_in_floor(world.state(0), half), 0.2 * half.y())
                << length << " m, " << rate << " Hz, " << tilt << " degrees";
        }
        EXPECT_LT(sum / std::size(tilts), bound) << length << " m, " << rate << " Hz";
    }
}

}  // namespace
