#include "motion_model.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace tracking {
namespace {

Transition polynomial_transition(double dt) {
    return {dt, dt * dt / 2, dt, 1};
}

AxisMatrix<double> scaled_matrix(const AxisMatrix<double>& m, double factor) {
    return {factor * m.pp, factor * m.pv, factor * m.pa, factor * m.vv, factor * m.va, factor * m.aa};
}

/// u - 1 + exp(-u) without cancellation; `decay` = expm1(-u).
double decayed_displacement(double u, double decay) {
    if (u > 0.1) return u + decay;
    // u^2 (1/2 - u/6 + u^2/24 - ...), the terms left out are below 1e-17 of the first for u <= 0.1.
    double sum = 0;
    constexpr std::array<double, 9> kTerms = {1.0 / 2,     -1.0 / 6,      1.0 / 24,
                                              -1.0 / 120,  1.0 / 720,     -1.0 / 5040,
                                              1.0 / 40320, -1.0 / 362880, 1.0 / 3628800};
    for (std::size_t k = kTerms.size(); k-- > 0;) sum = sum * u + kTerms[k];
    return u * u * sum;
}

Transition singer_transition(double alpha, double dt) {
    const double u = alpha * dt;
    const double decay = std::expm1(-u);
    return {dt, decayed_displacement(u, decay) / (alpha * alpha), -decay / alpha, 1 + decay};
}

/// The six integrals over [0, 1] of products r_i(s) r_j(s), where r_p, r_v, r_a are the displacement, the
/// velocity and the acceleration a time s after a unit step of acceleration that decays at rate u:
/// power series in u, r_i = sum_k (-u)^k s^(k+m) / (k+m)! with m = 2, 1, 0, multiplied and integrated term by
/// term. The first term left out is below 1e-17 of the first one for u <= kSeriesLimit.
constexpr int kTerms = 16;
constexpr double kSeriesLimit = 0.25;

struct SingerSeries {
    std::array<std::array<double, kTerms>, 6> coefficient{};

    constexpr SingerSeries() {
        constexpr int kOrder[6][2] = {{2, 2}, {2, 1}, {2, 0}, {1, 1}, {1, 0}, {0, 0}};
        std::array<double, kTerms + 3> inverse_factorial{};
        inverse_factorial[0] = 1;
        for (int k = 1; k < kTerms + 3; ++k)
            inverse_factorial[static_cast<std::size_t>(k)] =
                inverse_factorial[static_cast<std::size_t>(k - 1)] / k;
        for (std::size_t entry = 0; entry < 6; ++entry)
            for (int n = 0; n < kTerms; ++n) {
                const int i = kOrder[entry][0], j = kOrder[entry][1];
                double sum = 0;
                for (int k = 0; k <= n; ++k)
                    sum += inverse_factorial[static_cast<std::size_t>(k + i)] *
                           inverse_factorial[static_cast<std::size_t>(n - k + j)];
                coefficient[entry][static_cast<std::size_t>(n)] = sum / (n + i + j + 1);
            }
    }
};
constexpr SingerSeries kSeries;

AxisMatrix<double> series_noise(double u, double dt) {
    std::array<double, 6> g{};
    for (std::size_t n = kTerms; n-- > 0;)
        for (std::size_t entry = 0; entry < 6; ++entry)
            g[entry] = kSeries.coefficient[entry][n] - u * g[entry];
    const double dt2 = dt * dt, dt3 = dt2 * dt;
    return {g[0] * dt3 * dt2, g[1] * dt2 * dt2, g[2] * dt3, g[3] * dt3, g[4] * dt2, g[5] * dt};
}

/// The same in closed form (Singer 1970, with sigma_m^2 2 alpha = 1); above kSeriesLimit cancellation costs
/// at most three digits.
AxisMatrix<double> closed_noise(double alpha, double u) {
    const double decay = std::expm1(-u);
    const double e = 1 + decay;
    const double twice = decay * (1 + e);  // exp(-2u) - 1
    const double a2 = alpha * alpha, a3 = a2 * alpha;
    return {(2 * u - 2 * u * u + 2 * u * u * u / 3 - 4 * u * e - twice) / (2 * a3 * a2),
            (decay + u) * (decay + u) / (2 * a2 * a2),
            (-twice - 2 * u * e) / (2 * a3),
            (4 * decay - twice + 2 * u) / (2 * a3),
            decay * decay / (2 * a2),
            -twice / (2 * alpha)};
}

struct TransitionOver {
    double dt;
    Transition operator()(const MotionModel::Singer& model) const {
        return singer_transition(model.alpha, dt);
    }
    template <typename Polynomial>
    Transition operator()(const Polynomial&) const {
        return polynomial_transition(dt);
    }
};

struct NoiseOver {
    double dt;
    AxisMatrix<double> operator()(const MotionModel::ConstantVelocity& model) const {
        const double q = model.q * dt;
        return {q * dt * dt / 3, q * dt / 2, 0, q, 0, 0};
    }
    AxisMatrix<double> operator()(const MotionModel::ConstantAcceleration& model) const {
        const double q = model.q * dt, q1 = q * dt, q2 = q1 * dt;
        return {q2 * dt * dt / 20, q2 * dt / 8, q2 / 6, q2 / 3, q1 / 2, q};
    }
    AxisMatrix<double> operator()(const MotionModel::Singer& model) const {
        const double u = model.alpha * dt;
        return scaled_matrix(u <= kSeriesLimit ? series_noise(u, dt) : closed_noise(model.alpha, u), model.q);
    }
    AxisMatrix<double> operator()(const MotionModel::FixedStep& model) const { return model.q; }
};

struct ScaledBy {
    double square;
    void operator()(MotionModel::FixedStep& model) const { model.q = scaled_matrix(model.q, square); }
    template <typename Driven>
    void operator()(Driven& model) const {
        model.q *= square;
    }
};

double largest_change(const AxisMatrix<double>& a, const AxisMatrix<double>& b) {
    const auto change = [](double x, double y) { return x == y ? 0 : std::abs(x - y) / std::abs(y); };
    return std::max({change(a.pp, b.pp), change(a.pv, b.pv), change(a.pa, b.pa), change(a.vv, b.vv),
                     change(a.va, b.va), change(a.aa, b.aa)});
}

}  // namespace

Transition MotionModel::transition(double dt) const noexcept {
    return std::visit(TransitionOver{dt}, kind);
}

AxisMatrix<double> MotionModel::process_noise(double dt) const noexcept {
    return std::visit(NoiseOver{dt}, kind);
}

MotionModel MotionModel::scaled(double factor) const {
    MotionModel other = *this;
    std::visit(ScaledBy{factor * factor}, other.kind);
    other.measurement_variance *= factor * factor;
    other.initial_variance *= factor * factor;
    return other;
}

SteadyState steady_state(const MotionModel& model, double dt) {
    constexpr int kMostSteps = 1'000'000;
    constexpr double kSettled = 1e-15;
    const Transition f = model.transition(dt);
    const AxisMatrix<double> q = model.process_noise(dt);
    SteadyState steady{model.initial_covariance(), {}};
    for (int step = 0; step < kMostSteps; ++step) {
        const AxisMatrix<double> before = steady.covariance;
        steady.covariance = propagated(before, f, q);
        steady.gain = correct(steady.covariance, model.measurement_variance);
        if (largest_change(before, steady.covariance) <= kSettled) break;
    }
    return steady;
}

}  // namespace tracking
