// Cost of the modes of a body (k elements per side), of a displacement and of its inverse.
#include <benchmark/benchmark.h>

#include <random>

#include "sim/modes.h"
#include "sim/world.h"

namespace {

using Eigen::Vector3d;

const sim::Superquadric kShape{{0.3, 0.2, 0.5}, 0.5, 1};
const sim::Material kRubber{1e6, 0.3, 1000};

sim::ModalBasis basis_of(int elements) {
    return sim::free_vibration_modes({kShape, sim::ModeDomain::superquadric, kRubber, elements, 12}).basis;
}

// Arguments: elements per side; 1 for the superquadric, 0 for its box.
void modes(benchmark::State& state) {
    const auto domain = state.range(1) == 1 ? sim::ModeDomain::superquadric : sim::ModeDomain::box;
    const sim::ModesRequest request{kShape, domain, kRubber, static_cast<int>(state.range(0)), 12};
    for (auto _ : state) benchmark::DoNotOptimize(sim::free_vibration_modes(request));
}
BENCHMARK(modes)->ArgsProduct({{1, 2, 4}, {0, 1}})->Unit(benchmark::kMillisecond);

void choose_fidelity(benchmark::State& state) {
    for (auto _ : state) benchmark::DoNotOptimize(sim::choose_fidelity(kShape, kRubber, {}));
}
BENCHMARK(choose_fidelity)->Unit(benchmark::kMillisecond);

/// Points of a body whose displacement has gradients up to about 0.2.
struct Deformed {
    explicit Deformed(int elements) : basis(basis_of(elements)) {
        std::mt19937 rng(1);
        std::uniform_real_distribution<double> unit(-1, 1);
        Eigen::VectorXd q(12);
        for (double& v : q) v = unit(rng);
        nodal = basis.nodal * q;
        nodal *= 0.03 / nodal.cwiseAbs().maxCoeff();
        for (Vector3d& p : points)
            p = 0.8 * Vector3d(unit(rng), unit(rng), unit(rng)).cwiseProduct(kShape.semi_axes);
    }
    sim::ModalBasis basis;
    Eigen::VectorXd nodal;
    std::array<Vector3d, 256> points;
};

void displacement_at(benchmark::State& state) {
    const Deformed body(static_cast<int>(state.range(0)));
    std::size_t i = 0;
    for (auto _ : state)
        benchmark::DoNotOptimize(sim::displacement_at(body.basis, body.nodal, body.points[i++ % 256]));
}
BENCHMARK(displacement_at)->Arg(1)->Arg(2)->Arg(4);

void inverse_displacement(benchmark::State& state) {
    const Deformed body(static_cast<int>(state.range(0)));
    std::size_t i = 0;
    double iterations = 0;
    for (auto _ : state) {
        const sim::InversePoint found =
            sim::inverse_displacement(body.basis, body.nodal, body.points[i++ % 256]);
        iterations += found.iterations;
        benchmark::DoNotOptimize(found);
    }
    state.counters["iterations"] = benchmark::Counter(iterations, benchmark::Counter::kAvgIterations);
}
BENCHMARK(inverse_displacement)->Arg(1)->Arg(2)->Arg(4);

}  // namespace
