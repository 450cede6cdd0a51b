#include "modes/oscillator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <random>

namespace {

struct State {
    double z, z_dot;
};

State stepped(double omega, double sigma, double dt, int steps, State s) {
    const sim::OscillatorStep step = sim::oscillator_step(omega, sigma, dt);
    for (int i = 0; i < steps; ++i) sim::advance(step, s.z, s.z_dot);
    return s;
}

// Fourth-order Runge-Kutta with small steps: knows nothing of the closed form.
State integrated(double omega, double sigma, double t, State s) {
    const int n = 20000;
    const double h = t / n;
    const auto rate = [&](State x) { return State{x.z_dot, -2 * sigma * x.z_dot - omega * omega * x.z}; };
    const auto plus = [](State x, double k, State y) { return State{x.z + k * y.z, x.z_dot + k * y.z_dot}; };
    for (int i = 0; i < n; ++i) {
        const State a = rate(s), b = rate(plus(s, h / 2, a)), c = rate(plus(s, h / 2, b)),
                    d = rate(plus(s, h, c));
        s = plus(plus(plus(plus(s, h / 6, a), h / 3, b), h / 3, c), h / 6, d);
    }
    return s;
}

// The step by the roots of lambda^2 + 2 sigma lambda + omega^2 = 0, complex, in 80 bits; z' in units of
// omega.
struct ByRoots {
    long double a, b_omega, c_over_omega, d;
};

ByRoots by_roots(double omega, double sigma, double dt) {
    using Complex = std::complex<long double>;
    const long double w = omega, s = sigma, t = dt;
    const Complex root = std::sqrt(Complex((s - w) * (s + w))), slow = -s + root, fast = -s - root;
    if (root == Complex()) {
        const long double e = std::exp(-s * t);
        return {e * (1 + s * t), e * w * t, -e * w * t, e * (1 - s * t)};
    }
    const Complex e_slow = std::exp(slow * t), e_fast = std::exp(fast * t), apart = slow - fast;
    const long double b = ((e_slow - e_fast) / apart).real();
    return {((slow * e_fast - fast * e_slow) / apart).real(), w * b, -w * b,
            ((slow * e_slow - fast * e_fast) / apart).real()};
}

void expect_step_by_roots(double omega, double sigma, double dt) {
    const sim::OscillatorStep step = sim::oscillator_step(omega, sigma, dt);
    const ByRoots exact = by_roots(omega, sigma, dt);
    // At omega dt = 1000 the phase itself is rounded to 1e-13.
    EXPECT_NEAR(step.a, exact.a, 1e-12) << omega * dt << ' ' << sigma / omega;
    EXPECT_NEAR(step.b * omega, exact.b_omega, 1e-12) << omega * dt << ' ' << sigma / omega;
    EXPECT_NEAR(step.c / omega, exact.c_over_omega, 1e-12) << omega * dt << ' ' << sigma / omega;
    EXPECT_NEAR(step.d, exact.d, 1e-12) << omega * dt << ' ' << sigma / omega;
}

TEST(Oscillator, TheStepMatchesItsRootsIn80BitsTo1EMinus12ForOmegaDt1EMinus3To1E3AndDampingRatio0To10) {
    std::mt19937 random(21);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int i = 0; i < 20000; ++i) {
        const double omega = std::pow(10, 4 * unit(random)), dt = std::pow(10, 6 * unit(random) - 3) / omega;
        const double ratio = i % 4 == 0 ? unit(random) : 10 * unit(random);
        expect_step_by_roots(omega, ratio * omega, dt);
    }
}

TEST(Oscillator, TheStepMatchesItsRootsTo1EMinus12AtNoDampingAndAroundCriticalDamping) {
    for (const double omega_dt : {1e-3, 0.01, 0.1, 0.5, 1.0, 3.14159, 10.0, 30.0, 100.0, 1e3})
        for (const double away : {-1.0, -1e-2, -1e-4, -1e-6, -1e-9, 0.0, 1e-9, 1e-6, 1e-4, 1e-2, 9.0})
            expect_step_by_roots(50, 50 * (1 + away), omega_dt / 50);
}

TEST(Oscillator, UndampedEnergyHoldsTo1EMinus9OverAMillionStepsAtAnyOmegaDt) {
    for (const double omega_dt : {1e-3, 0.02, 0.5, 2.1, 40.0, 1e3}) {
        const State s = stepped(30, 0, omega_dt / 30, 1'000'000, {0.3, 1});
        const double before = 1 + 900 * 0.09, after = s.z_dot * s.z_dot + 900 * s.z * s.z;
        EXPECT_NEAR(after / before, 1, 1e-9) << omega_dt;  // a million roundings of 2e-16, all to one side
    }
}

TEST(Oscillator, UndampedEnergyHoldsToAPartInTenToTheTwelfthOver600StepsAtAnyOmegaDt) {
    for (const double omega_dt : {1e-6, 0.01, 0.5, 2.1, 3.14159, 40.0}) {
        const double omega = 30, dt = omega_dt / omega;
        const State s = stepped(omega, 0, dt, 600, {0.3, 1});
        const double before = 1 + 900 * 0.09, after = s.z_dot * s.z_dot + 900 * s.z * s.z;
        EXPECT_NEAR(after / before, 1, 1e-12) << omega_dt;  // 600 roundings of 1e-16 each way
    }
}

TEST(Oscillator, UnderAtAndOverCriticalDampingMatchNumericalIntegration) {
    for (const double sigma : {0.0, 5.0, 19.9, 19.999999, 20.0, 20.000001, 20.1, 60.0}) {
        const State exact = stepped(20, sigma, 0.25, 1, {0.4, -3}),
                    numeric = integrated(20, sigma, 0.25, {0.4, -3});
        EXPECT_NEAR(exact.z, numeric.z, 1e-11) << sigma;  // RK4's own error is below 1e-12 here
        EXPECT_NEAR(exact.z_dot, numeric.z_dot, 1e-10) << sigma;
    }
}

TEST(Oscillator, OneLongStepEqualsAThousandShortOnes) {
    for (const double sigma : {0.0, 3.0, 20.0, 300.0}) {
        const State one = stepped(20, sigma, 0.5, 1, {1, 2}), many = stepped(20, sigma, 0.0005, 1000, {1, 2});
        EXPECT_NEAR(one.z, many.z, 1e-12);
        EXPECT_NEAR(one.z_dot, many.z_dot, 1e-10);
    }
}

TEST(Oscillator, HeavyOverdampingOverALongTimeNeitherOverflowsNorIsNan) {
    const State s = stepped(10, 1e5, 1000, 1, {1, 1});
    EXPECT_TRUE(std::isfinite(s.z) && std::isfinite(s.z_dot));
    EXPECT_NEAR(s.z, std::exp(-0.5), 1e-4);  // the slow root is omega^2 / (2 sigma) = 5e-4 1/s
}

}  // namespace
