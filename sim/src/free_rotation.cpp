#include "free_rotation.h"

#include <cmath>

namespace sim {
namespace {

// cos(phi) and sin(phi) / phi from phi^2; both are even, so small angles need no root. The first term left
// out is below 1e-18 at the border.
struct EvenParts {
    double cosine, sinc;
};

EvenParts even_parts(double x) {
    if (x > 0.0625) {
        const double phi = std::sqrt(x);
        return {std::cos(phi), std::sin(phi) / phi};
    }
    return {1 - x * (1. / 2 -
                     x * (1. / 24 - x * (1. / 720 - x * (1. / 40320 - x * (1. / 3628800 - x / 479001600))))),
            1 - x * (1. / 6 - x * (1. / 120 - x * (1. / 5040 - x * (1. / 362880 -
                                                                    x * (1. / 39916800 - x / 6227020800)))))};
}

// q <- q (c + s e_Axis) and m, the same vector in the turned body's frame.
template <int Axis>
void turn(double rate, Eigen::Quaterniond& q, Eigen::Vector3d& m) {
    constexpr int kNext = (Axis + 1) % 3, kLast = (Axis + 2) % 3;
    const double phi = rate * m[Axis];
    const EvenParts even = even_parts(phi * phi);
    const double c = even.cosine, s = even.sinc * phi;

    const Eigen::Vector4d v = q.coeffs();  // x, y, z, w
    Eigen::Vector4d& turned = q.coeffs();
    turned[3] = c * v[3] - s * v[Axis];
    turned[Axis] = c * v[Axis] + s * v[3];
    turned[kNext] = c * v[kNext] + s * v[kLast];
    turned[kLast] = c * v[kLast] - s * v[kNext];

    const double cos_whole = 1 - 2 * s * s, sin_whole = 2 * s * c;
    const double next = m[kNext];
    m[kNext] = cos_whole * next + sin_whole * m[kLast];
    m[kLast] = cos_whole * m[kLast] - sin_whole * next;
}

// Half a turn about b, one about c, half a turn about b.
template <int B, int C>
void split(double rate_b, double rate_c, Eigen::Quaterniond& q, Eigen::Vector3d& m) {
    turn<B>(rate_b, q, m);
    turn<C>(rate_c, q, m);
    turn<B>(rate_b, q, m);
}

int middle(const Eigen::Vector3d& v) {
    for (int i = 0; i < 3; ++i) {
        const double p = v[(i + 1) % 3], q = v[(i + 2) % 3];
        if ((v[i] - p) * (v[i] - q) <= 0) return i;
    }
    return 0;
}

}  // namespace

FreeRotation::FreeRotation(const Eigen::Vector3d& inertia, double dt) noexcept : reference_(middle(inertia)) {
    const Eigen::Vector3d inverse = inertia.cwiseInverse();
    const double shared = inverse[reference_];
    world_rate_ = dt / 2 * shared;
    rate_b_ = dt / 4 * (inverse[(reference_ + 1) % 3] - shared);
    rate_c_ = dt / 2 * (inverse[(reference_ + 2) % 3] - shared);
}

Eigen::Quaterniond FreeRotation::advance(const Eigen::Quaterniond& body_to_world,
                                         const Eigen::Vector3d& angular_momentum_world) const noexcept {
    Eigen::Quaterniond q = body_to_world;
    if (rate_b_ != 0 || rate_c_ != 0) {
        Eigen::Vector3d m = q.conjugate() * angular_momentum_world;
        switch (reference_) {
            case 0:
                split<1, 2>(rate_b_, rate_c_, q, m);
                break;
            case 1:
                split<2, 0>(rate_b_, rate_c_, q, m);
                break;
            default:
                split<0, 1>(rate_b_, rate_c_, q, m);
        }
    }
    const Eigen::Vector3d half_turn = world_rate_ * angular_momentum_world;
    const EvenParts even = even_parts(half_turn.squaredNorm());
    const Eigen::Vector3d v = even.sinc * half_turn;
    const Eigen::Quaterniond turned = Eigen::Quaterniond(even.cosine, v.x(), v.y(), v.z()) * q;
    // One Newton step towards unit length: turned is off by rounding only, unless the input was.
    const double n = turned.squaredNorm();
    return Eigen::Quaterniond(turned.coeffs() * (std::abs(n - 1) < 1e-7 ? 1.5 - 0.5 * n : 1 / std::sqrt(n)));
}

}  // namespace sim
