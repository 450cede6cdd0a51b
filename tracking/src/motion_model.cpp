#include "motion_model.h"

#include <cmath>

namespace tracking {
namespace {

Transition polynomial_transition(double dt) {
    Transition f;
    f << 1, dt, dt * dt / 2, 0, 1, dt, 0, 0, 1;
    return f;
}

/// u - 1 + exp(-u) without cancellation.
double decayed_displacement(double u) {
    if (u > 0.1) return u + std::expm1(-u);
    // u^2 (1/2 - u/6 + u^2/24 - ...), the terms left out are below 1e-17 of the first for u <= 0.1.
    double term = u * u / 2;
    double sum = term;
    for (int k = 3; k <= 11; ++k) sum += term *= -u / k;
    return sum;
}

/// Response of [p, v, a] a time s after a unit step of acceleration that decays at rate alpha.
Eigen::Vector3d singer_response(double alpha, double s) {
    const double u = alpha * s;
    return {decayed_displacement(u) / (alpha * alpha), -std::expm1(-u) / alpha, std::exp(-u)};
}

/// Integral of response * response^T over [0, dt]: exact discretisation, by Gauss-Legendre quadrature with 8
/// nodes on pieces of alpha * length <= 1, where its error is below the rounding (the integrand is analytic).
Eigen::Matrix3d singer_noise(const MotionModel::Singer& model, double dt) {
    constexpr double kNode[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267,
                                 0.9602898564975363};
    constexpr double kWeight[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745,
                                   0.1012285362903763};
    const int pieces = 1 + static_cast<int>(model.alpha * dt);
    const double half = dt / (2 * pieces);
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (int piece = 0; piece < pieces; ++piece)
        for (int node = 0; node < 4; ++node)
            for (const double side : {-1.0, 1.0}) {
                const Eigen::Vector3d r =
                    singer_response(model.alpha, (2 * piece + 1 + side * kNode[node]) * half);
                sum += kWeight[node] * half * (r * r.transpose());
            }
    return model.q * sum;
}

struct TransitionOver {
    double dt;
    Transition operator()(const MotionModel::Singer& model) const {
        Transition f = polynomial_transition(dt);
        f.col(2) = singer_response(model.alpha, dt);
        return f;
    }
    template <typename Polynomial>
    Transition operator()(const Polynomial&) const {
        return polynomial_transition(dt);
    }
};

struct NoiseOver {
    double dt;
    Eigen::Matrix3d operator()(const MotionModel::ConstantVelocity& model) const {
        Eigen::Matrix3d q;
        q << dt * dt * dt / 3, dt * dt / 2, 0, dt * dt / 2, dt, 0, 0, 0, 0;
        return model.q * q;
    }
    Eigen::Matrix3d operator()(const MotionModel::ConstantAcceleration& model) const {
        const double dt2 = dt * dt;
        Eigen::Matrix3d q;
        q << dt2 * dt2 * dt / 20, dt2 * dt2 / 8, dt2 * dt / 6,  //
            dt2 * dt2 / 8, dt2 * dt / 3, dt2 / 2,               //
            dt2 * dt / 6, dt2 / 2, dt;
        return model.q * q;
    }
    Eigen::Matrix3d operator()(const MotionModel::Singer& model) const { return singer_noise(model, dt); }
    Eigen::Matrix3d operator()(const MotionModel::FixedStep& model) const { return model.q; }
};

struct ScaledBy {
    double square;
    void operator()(MotionModel::FixedStep& model) const { model.q *= square; }
    template <typename Driven>
    void operator()(Driven& model) const {
        model.q *= square;
    }
};

}  // namespace

Transition MotionModel::transition(double dt) const noexcept {
    return std::visit(TransitionOver{dt}, kind);
}

Eigen::Matrix3d MotionModel::process_noise(double dt) const noexcept {
    return std::visit(NoiseOver{dt}, kind);
}

MotionModel MotionModel::scaled(double factor) const {
    MotionModel other = *this;
    std::visit(ScaledBy{factor * factor}, other.kind);
    other.measurement_variance *= factor * factor;
    other.initial_variance *= factor * factor;
    return other;
}

}  // namespace tracking
