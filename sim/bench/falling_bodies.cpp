#include "falling_bodies.h"

#include <cmath>
#include <random>

namespace sim_bench {
namespace {

// Uniform in [-1, 1], the same with every standard library.
double jitter(std::mt19937& random) {
    return random() / 2147483647.5 - 1;
}

sim::WorldBody ball(int modes) {
    sim::WorldBody body;
    body.shape.base.semi_axes.setConstant(kBallRadius_m);
    body.material = {.young_pa = 3e5, .poisson = 0.3, .density_kg_m3 = 1000};
    body.damping_ratio = 0.05;
    body.fidelity.fidelity = modes > 0 ? sim::Fidelity::modal : sim::Fidelity::rigid;
    body.fidelity.modes = modes;
    body.triangles = kBallTriangles;
    return body;
}

}  // namespace

bool is_benchmark_ball(const sim::WorldBody& body) {
    return body.shape.base.semi_axes == Eigen::Vector3d::Constant(kBallRadius_m) && body.shape.base.e1 == 1 &&
           body.shape.base.e2 == 1 && body.shape.bumps.empty() && body.triangles == kBallTriangles &&
           body.fidelity.fidelity == sim::Fidelity::modal && !body.fixed;
}

double box_side(int count) {
    return 0.72 * std::sqrt(count);
}

sim::WorldDefinition falling_balls(int count, int modes) {
    constexpr double kSpacing_m = 1.15, kLayer_m = 1.3, kJitter_m = 0.05;
    sim::WorldDefinition world;
    world.settings.sleeping = false;
    const double side = box_side(count);
    world.planes.push_back({Eigen::Vector3d::UnitY(), 0});
    for (const int axis : {0, 2})
        for (const double sign : {1.0, -1.0})
            world.planes.push_back({sign * Eigen::Vector3d::Unit(axis), -side / 2});

    std::mt19937 random(1992);
    const int row = std::max(1, static_cast<int>(side / kSpacing_m)), layer = row * row;
    for (int i = 0; i < count; ++i) {
        sim::WorldBody body = ball(modes);
        body.name = "ball" + std::to_string(i);
        const Eigen::Vector3d cell((i % row) - (row - 1) / 2.0, i / layer,
                                   (i % layer) / row - (row - 1) / 2.0);
        const double x = jitter(random), y = jitter(random), z = jitter(random);
        body.world_from_body.translation() =
            cell.cwiseProduct(Eigen::Vector3d(kSpacing_m, kLayer_m, kSpacing_m)) + Eigen::Vector3d(0, 1, 0) +
            kJitter_m * Eigen::Vector3d(x, y, z);
        world.bodies.push_back(body);
    }
    return world;
}

}  // namespace sim_bench
