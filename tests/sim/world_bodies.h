#pragma once
#include <sim/world.h>

#include <cmath>
#include <random>

/// Bodies for tests of the world.
namespace world_test {

inline sim::WorldBody ball(const Eigen::Vector3d& at, sim::Fidelity fidelity = sim::Fidelity::rigid,
                           double radius = 0.5, double density = 100) {
    sim::WorldBody body;
    body.name = "ball";
    body.shape.base.semi_axes.setConstant(radius);
    body.material = {1e6, 0.3, density};
    body.fidelity.fidelity = fidelity;
    body.fidelity.modes = 12;
    body.world_from_body.translation() = at;
    return body;
}

inline sim::WorldBody box(const Eigen::Vector3d& at, const Eigen::Vector3d& half, double density = 100) {
    sim::WorldBody body = ball(at);
    body.name = "box";
    body.shape.base = {half, 0.1, 0.1};
    body.material.density_kg_m3 = density;
    return body;
}

inline sim::WorldDefinition on_floor() {
    sim::WorldDefinition world;
    world.planes.push_back({});
    return world;
}

inline sim::WorldDefinition weightless() {
    sim::WorldDefinition world;
    world.settings.gravity.setZero();
    return world;
}

inline void run(sim::World& world, int steps) {
    for (int i = 0; i < steps; ++i) world.step();
}

/// Random numbers, the same with every standard library.
class Draw {
public:
    explicit Draw(unsigned seed) : random_(seed) {}
    double between(double a, double b) { return a + (b - a) * (random_() / 4294967296.0); }
    double scale(double a, double b) { return std::exp(between(std::log(a), std::log(b))); }
    int below(int n) { return static_cast<int>(random_() % static_cast<unsigned>(n)); }
    Eigen::Vector3d direction() {
        Eigen::Vector3d v;
        do v = {between(-1, 1), between(-1, 1), between(-1, 1)};
        while (v.norm() > 1 || v.norm() < 0.1);
        return v.normalized();
    }

private:
    std::mt19937 random_;
};

}  // namespace world_test
