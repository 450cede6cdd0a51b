#pragma once
#include <sim/world.h>

namespace sim_bench {

/// Soft balls that fall into a box, as in the benchmark of 25 bodies of the thesis (figure 2-4), for any
/// number.
constexpr double kBallRadius_m = 0.5;
constexpr int kBallTriangles = 360;  ///< 182 vertices

/// `count` balls of 1000 kg/m^3 with `modes` modes (0: rigid); twelve swing at 9 to 13 Hz, slow enough for
/// explicit integrators at 1/60 s, too. They start at rest in layers 1.3 m apart, 1.15 m from each other,
/// jittered by up to 5 cm (fixed seed), above a floor of 0.72 m x 0.72 m a ball with four walls: two or three
/// layers when they have come to rest. Nothing sleeps, so every step is work.
[[nodiscard]] sim::WorldDefinition falling_balls(int count, int modes = 12);

/// Whether a body is such a ball, of any material and place.
[[nodiscard]] bool is_benchmark_ball(const sim::WorldBody& body);

/// Side of the box [m].
[[nodiscard]] double box_side(int count);

}  // namespace sim_bench
