#include "filter/interacting_models.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "tracking/drummer.h"
#include "tracking/sensor.h"

namespace tracking {
namespace {

using Real = long double;
using Matrix = Eigen::Matrix<Real, 3, 3>;
using Vector = Eigen::Matrix<Real, 3, 1>;

constexpr Real kDecayRate = 3, kRate = 10, kVariance = 0.25e-3L * 0.25e-3L;
constexpr std::array<Real, 3> kDensities = {1e3L, 3e4L, 1e6L};

/// The docstring of InteractingModels word for word, with whole matrices for each axis and mode in long
/// double, Q by quadrature.
class Oracle {
public:
    void start(double t, const Eigen::Vector3d& z) {
        t_ = t;
        mu_.fill(Real(1) / 3);
        for (std::size_t axis = 0; axis < 3; ++axis)
            for (std::size_t j = 0; j < 3; ++j) {
                x_[axis][j] = Vector(z[static_cast<int>(axis)], 0, 0);
                p_[axis][j] = Vector(1e-4L, 1, 100).asDiagonal();
            }
    }

    void correct(double t, const Eigen::Vector3d& z) {
        const Real dt = Real(t) - t_;
        t_ = t;
        std::array<std::array<Real, 3>, 3> w;
        const std::array<Real, 3> c = mix_weights(dt, w);
        std::array<Real, 3> likelihood = {1, 1, 1};
        for (std::size_t axis = 0; axis < 3; ++axis)
            update_axis(axis, dt, z[static_cast<int>(axis)], w, likelihood);
        Real sum = 0;
        for (std::size_t j = 0; j < 3; ++j) sum += mu_[j] = c[j] * likelihood[j];
        Real floored = 0;
        for (Real& mu : mu_) floored += mu = std::max(mu / sum, Real(1e-6L));
        for (Real& mu : mu_) mu /= floored;
    }

    [[nodiscard]] Eigen::Vector3d predict(double lead) const {
        Eigen::Vector3d position;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            Vector mean = Vector::Zero();
            for (std::size_t j = 0; j < 3; ++j) mean += mu_[j] * x_[axis][j];
            position[static_cast<int>(axis)] = static_cast<double>((transition(lead) * mean)(0));
        }
        return position;
    }
    [[nodiscard]] Real probability(std::size_t j) const { return mu_[j]; }

private:
    static Matrix transition(Real dt) {
        const Real e = std::exp(-kDecayRate * dt);
        Matrix f;
        f << 1, dt, (kDecayRate * dt - 1 + e) / (kDecayRate * kDecayRate), 0, 1, (1 - e) / kDecayRate, 0, 0,
            e;
        return f;
    }
    /// The integral of r r^T over [0, dt], r the last column of F, by Gauss and Legendre's rule with five
    /// nodes, which is exact for polynomials of degree 9 (r r^T is one of degree 4 but for (alpha dt)^k).
    static Matrix noise(Real dt) {
        const Real root = std::sqrt(Real(10) / 7), part = 13 * std::sqrt(Real(70));
        const Real node[] = {0, std::sqrt(5 - 2 * root) / 3, std::sqrt(5 + 2 * root) / 3};
        const Real weight[] = {Real(64) / 225, (322 + part) / 900, (322 - part) / 900};
        Matrix sum = Matrix::Zero();
        for (int i = 0; i < 3; ++i)
            for (const int side : {-1, 1}) {
                const Vector r = transition(dt / 2 * (1 + side * node[i])).col(2);
                sum += dt / 2 * weight[i] * (r * r.transpose());
            }
        return sum;
    }
    std::array<Real, 3> mix_weights(Real dt, std::array<std::array<Real, 3>, 3>& w) const {
        const Real stay = std::exp(-kRate * dt);
        std::array<Real, 3> c{};
        for (std::size_t j = 0; j < 3; ++j) {
            for (std::size_t i = 0; i < 3; ++i) c[j] += w[i][j] = (i == j ? stay : (1 - stay) / 2) * mu_[i];
            for (std::size_t i = 0; i < 3; ++i) w[i][j] /= c[j];
        }
        return c;
    }
    void update_axis(std::size_t axis, Real dt, Real z, const std::array<std::array<Real, 3>, 3>& w,
                     std::array<Real, 3>& likelihood) {
        std::array<Vector, 3> x;
        std::array<Matrix, 3> p;
        for (std::size_t j = 0; j < 3; ++j) {
            Vector mean = Vector::Zero();
            for (std::size_t i = 0; i < 3; ++i) mean += w[i][j] * x_[axis][i];
            Matrix spread = Matrix::Zero();
            for (std::size_t i = 0; i < 3; ++i) {
                const Vector d = x_[axis][i] - mean;
                spread += w[i][j] * (p_[axis][i] + d * d.transpose());
            }
            const Matrix f = transition(dt);
            mean = (f * mean).eval();
            spread = (f * spread * f.transpose() + kDensities[j] * noise(dt)).eval();
            const Real s = spread(0, 0) + kVariance, innovation = z - mean(0);
            const Vector k = spread.col(0) / s;
            likelihood[j] *= std::exp(-innovation * innovation / (2 * s)) / std::sqrt(s);
            const Matrix keep = Matrix::Identity() - k * Vector::UnitX().transpose();
            x[j] = mean + k * innovation;
            p[j] = keep * spread * keep.transpose() + kVariance * k * k.transpose();
        }
        x_[axis] = x;
        p_[axis] = p;
    }

    Real t_ = 0;
    std::array<Real, 3> mu_{};
    std::array<std::array<Vector, 3>, 3> x_;  // [axis][mode]
    std::array<std::array<Matrix, 3>, 3> p_;
};

StickTrace strokes() {
    std::vector<Stroke> score;
    for (int i = 0; i < 12; ++i)
        score.push_back({0.5 + 0.35 * i,
                         "right",
                         {0.1 * (i % 3), 0.8, -0.1 * (i % 2)},
                         {0.1, 1, 0.2},
                         2.0 + 0.4 * i,
                         i % 4 == 3 ? StrokeKind::feint : StrokeKind::hit});
    for (Stroke& stroke : score) stroke.normal.normalize();
    DrummerParameters drummer;
    drummer.rate_hz = 500;
    return synthesise(score, 5, drummer).sticks.at(0);
}

// 1e-9 mm on positions of 1 m leaves four digits of a double for what the filter's squares lose.
TEST(InteractingModels, AreTheirDocstringInLongDoubleTo1e9thOfAMillimetre) {
    const StickTrace path = strokes();
    for (const double rate : {60.0, 120.0})
        for (const double jitter : {0.0, 0.003}) {
            SensorModel sensor;
            sensor.rate_hz = rate;
            sensor.jitter_s = jitter;
            const auto predictor = make_predictor("imm:alpha=3,q1=1e9,q2=3e10,q3=1e12,rate=10,r=0.25");
            const auto& imm = dynamic_cast<const InteractingModels&>(*predictor);
            Oracle oracle;
            double worst = 0, worst_probability = 0;
            bool first = true;
            for (const PoseSample& sample : sense(path, sensor)) {
                (void)predictor->correct(sample);
                first ? oracle.start(sample.t_s, sample.position)
                      : oracle.correct(sample.t_s, sample.position);
                first = false;
                for (const double lead : {0.0, 1.0 / 30, 1.0 / 15, 1.0 / 10})
                    worst =
                        std::max(worst, (predictor->predict(lead).position - oracle.predict(lead)).norm());
                for (std::size_t j = 0; j < 3; ++j)
                    worst_probability = std::max(
                        worst_probability,
                        std::abs(imm.probabilities()[j] - static_cast<double>(oracle.probability(j))));
            }
            std::printf("imm, %g Hz, jitter %g s: %.2g mm, probabilities %.2g\n", rate, jitter, 1e3 * worst,
                        worst_probability);
            EXPECT_LT(1e3 * worst, 1e-9) << rate << ' ' << jitter;
            EXPECT_LT(worst_probability, 1e-9);
        }
}

}  // namespace
}  // namespace tracking
