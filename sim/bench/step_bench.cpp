// Cost of a simulation step: a kit of ten drums, two sticks of eight nodes each, two pictures. Prints what
// Google Benchmark prints.
#include <benchmark/benchmark.h>

#include <random>

#include "sim/simulation.h"

namespace {

using Eigen::Vector3d;

// So many drums, 0.4 m apart in rows of five.
std::vector<sim::BodyDefinition> drums(int count) {
    std::vector<sim::BodyDefinition> bodies(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
        sim::BodyDefinition& body = bodies[static_cast<std::size_t>(i)];
        body.shape = {{0.18, 0.1, 0.18}, 0.1, 1};
        body.world_from_body.translation() = Vector3d(0.4 * (i % 5), 0.8, 0.45 * (i / 5));
    }
    return bodies;
}

// The path of a tip that comes down on a point from 0.15 m above at 4 m/s: 8 nodes over 1/15 s from t on.
sim::TipPath stroke(const Vector3d& at, double t) {
    sim::TipPath path;
    for (int k = 0; k < 8; ++k) {
        const double h = k / 15.0 / 7;
        path.nodes.push_back({t + h, at + Vector3d(0.5 * h, 0.15 - 4 * h, 0), Vector3d(0.5, -4, 0)});
    }
    return path;
}

// Argument: 1 with bodies that ring, 0 at rest.
void step(benchmark::State& state) {
    const std::vector<sim::BodyDefinition> bodies = drums(10);
    const auto simulation = sim::make_local_simulation(bodies);
    std::mt19937 rng(1);
    double t = 0;
    for (auto _ : state) {
        sim::StepRequest request{t += 1 / 60.0, {}, {}, {}, {{t + 0.01, {}}, {t + 0.03, {}}}};
        for (int stick = 0; stick < 2; ++stick) {
            request.paths.push_back(
                stroke(bodies[rng() % 10].world_from_body.translation() + Vector3d(0.05, 0.1, 0), t));
        }
        if (state.range(0) == 1) {
            request.folded.push_back(
                {static_cast<std::uint32_t>(rng() % 10), t, Vector3d(0.05, 0.1, 0), Vector3d(0, -0.3, 0)});
        }
        benchmark::DoNotOptimize(simulation->step(request));
    }
}
BENCHMARK(step)->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

void distance(benchmark::State& state) {
    sim::BodyDefinition body;
    body.shape = {{0.18, 0.1, 0.18}, 0.1 * static_cast<double>(state.range(0)), 1};
    std::mt19937 rng(2);
    std::uniform_real_distribution<double> unit(-1, 1);
    std::vector<Vector3d> points(1024);
    for (Vector3d& p : points) p = Vector3d(0.2 * unit(rng), 0.12 * unit(rng), 0.2 * unit(rng));
    std::size_t i = 0;
    for (auto _ : state)
        benchmark::DoNotOptimize(sim::rest_distance(body, points[i++ % points.size()], 0.006));
}
BENCHMARK(distance)->Arg(1)->Arg(5)->Arg(10);  // e1 in tenths

}  // namespace
