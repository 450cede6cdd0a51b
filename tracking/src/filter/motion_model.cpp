#include "filter/motion_model.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace tracking {
namespace {

AxisMatrix<double> scaled_matrix(const AxisMatrix<double>& m, double factor) {
    return {factor * m.pp, factor * m.pv, factor * m.pa, factor * m.vv, factor * m.va, factor * m.aa};
}

/// exp(-u) - 1 and u - 1 + exp(-u), neither with cancellation.
struct Decay {
    double change, displacement;
};

Decay decay(double u) {
    if (u > 0.25) {
        const double change = std::exp(-u) - 1;
        return {change, u + change};
    }
    // u^2 (1/2 - u/6 + u^2/24 - ...), the terms left out are below 1e-17 of the first for u <= 0.25. Even and
    // odd powers run side by side.
    constexpr double kTerms[12] = {1.0 / 2,       -1.0 / 6,        1.0 / 24,        -1.0 / 120,
                                   1.0 / 720,     -1.0 / 5040,     1.0 / 40320,     -1.0 / 362880,
                                   1.0 / 3628800, -1.0 / 39916800, 1.0 / 479001600, -1.0 / 6227020800};
    const double square = u * u;
    double even = kTerms[10], odd = kTerms[11];
    for (int k = 8; k >= 0; k -= 2) {
        even = even * square + kTerms[k];
        odd = odd * square + kTerms[k + 1];
    }
    const double displacement = square * (even + u * odd);
    return {displacement - u, displacement};
}

Transition singer_transition(double alpha, double dt, const Decay& d) {
    const double time = 1 / alpha;
    return {dt, d.displacement * (time * time), 1, -d.change * time, 1 + d.change};
}

/// The six integrals over [0, 1] of products r_i(s) r_j(s), where r_p, r_v, r_a are the displacement, the
/// velocity and the acceleration a time s after a unit step of acceleration that decays at rate u:
/// power series in u, r_i = sum_k (-u)^k s^(k+m) / (k+m)! with m = 2, 1, 0, multiplied and integrated term by
/// term. The first term left out is below 1e-17 of the first one for u <= kSeriesLimit.
constexpr int kTerms = 16;
constexpr double kSeriesLimit = 0.25;

struct SingerSeries {
    std::array<std::array<double, 6>, kTerms> coefficient{};  // [power][entry]

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
                coefficient[static_cast<std::size_t>(n)][entry] = sum / (n + i + j + 1);
            }
    }
};
constexpr SingerSeries kSeries;

AxisMatrix<double> series_noise(double u, double dt) {
    const double square = u * u;
    std::array<double, 6> even{}, odd{};
    for (std::size_t n = kTerms; n > 0; n -= 2)
        for (std::size_t entry = 0; entry < 6; ++entry) {
            odd[entry] = odd[entry] * square + kSeries.coefficient[n - 1][entry];
            even[entry] = even[entry] * square + kSeries.coefficient[n - 2][entry];
        }
    const auto g = [&](std::size_t entry) { return even[entry] - u * odd[entry]; };
    const double dt2 = dt * dt, dt3 = dt2 * dt;
    return {g(0) * (dt3 * dt2), g(1) * (dt2 * dt2), g(2) * dt3, g(3) * dt3, g(4) * dt2, g(5) * dt};
}

/// The same in closed form (Singer 1970, with sigma_m^2 2 alpha = 1); above kSeriesLimit cancellation costs
/// at most four digits.
AxisMatrix<double> closed_noise(double alpha, double u, const Decay& d) {
    const double e = 1 + d.change;
    const double twice = d.change * (1 + e);  // exp(-2u) - 1
    const double time = 1 / alpha, t2 = time * time, t3 = t2 * time;
    return {(2 * u - 2 * u * u + u * u * u * (2.0 / 3) - 4 * u * e - twice) * (t3 * t2 / 2),
            d.displacement * d.displacement * (t2 * t2 / 2),
            (-twice - 2 * u * e) * (t3 / 2),
            (4 * d.change - twice + 2 * u) * (t3 / 2),
            d.change * d.change * (t2 / 2),
            -twice * (time / 2)};
}

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

Transition MotionModel::Singer::transition(double dt) const noexcept {
    return singer_transition(alpha, dt, decay(alpha * dt));
}

MotionStep MotionModel::Singer::step(double dt) const noexcept {
    const double u = alpha * dt;
    const Decay d = decay(u);
    return {singer_transition(alpha, dt, d),
            scaled_matrix(u <= kSeriesLimit ? series_noise(u, dt) : closed_noise(alpha, u, d), q)};
}

// One integration less than Singer's: its velocity and acceleration stand for position and velocity.
Transition MotionModel::DecayingVelocity::transition(double dt) const noexcept {
    const Transition f = Singer{decay, q}.transition(dt);
    return {f.va, 0, f.aa, 0, 1};
}

MotionStep MotionModel::DecayingVelocity::step(double dt) const noexcept {
    const MotionStep step = Singer{decay, q}.step(dt);
    return {{step.f.va, 0, step.f.aa, 0, 1}, {step.q.vv, step.q.va, 0, step.q.aa, 0, 0}};
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
    const MotionStep step = model.step(dt);
    SteadyState steady{{}, model.initial_covariance(), {}};
    for (int i = 0; i < kMostSteps; ++i) {
        const AxisMatrix<double> last = steady.covariance;
        steady.before = steady.covariance = propagated(last, step);
        steady.gain = correct(steady.covariance, model.measurement_variance);
        if (largest_change(last, steady.covariance) <= kSettled) break;
    }
    return steady;
}

}  // namespace tracking
