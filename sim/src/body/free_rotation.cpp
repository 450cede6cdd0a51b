#include "body/free_rotation.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

// cos(phi) and sin(phi) / phi from phi^2; both are even, so small angles need no root. The first term left
// out is below 3e-17 at either border.
struct EvenParts {
    double cosine, sinc;
};

EvenParts even_parts(double x) {
    if (x < 1e-3)
        return {1 - x * (1. / 2 - x * (1. / 24 - x * (1. / 720))),
                1 - x * (1. / 6 - x * (1. / 120 - x * (1. / 5040)))};
    if (x > 0.0625) {
        const double phi = std::sqrt(x);
        return {std::cos(phi), std::sin(phi) / phi};
    }
    return {
        1 - x * (1. / 2 - x * (1. / 24 - x * (1. / 720 -
                                              x * (1. / 40320 - x * (1. / 3628800 - x * (1. / 479001600)))))),
        1 - x * (1. / 6 -
                 x * (1. / 120 -
                      x * (1. / 5040 - x * (1. / 362880 - x * (1. / 39916800 - x * (1. / 6227020800))))))};
}

// Coordinates of the orientation and of the momentum, body axes, turned in place. Scalars: partial writes of
// vectors stall.
struct Turning {
    double w, v[3], m[3];

    // q <- q (c + s e_Axis) and m, the same vector in the turned body's frame.
    template <int Axis>
    void turn(double rate) {
        constexpr int kNext = (Axis + 1) % 3, kLast = (Axis + 2) % 3;
        const double phi = rate * m[Axis];
        const EvenParts even = even_parts(phi * phi);
        const double c = even.cosine, s = even.sinc * phi;
        const double real = w, along = v[Axis], next = v[kNext], momentum = m[kNext];
        w = c * real - s * along;
        v[Axis] = c * along + s * real;
        v[kNext] = c * next + s * v[kLast];
        v[kLast] = c * v[kLast] - s * next;

        const double cos_whole = 1 - 2 * s * s, sin_whole = 2 * s * c;
        m[kNext] = cos_whole * momentum + sin_whole * m[kLast];
        m[kLast] = cos_whole * m[kLast] - sin_whole * momentum;
    }

    // Half a turn about b, one about c, half a turn about b, in so many parts.
    template <int B, int C>
    void split(double rate_b, double rate_c, int parts) {
        if (parts > 1) [[unlikely]] {
            rate_b /= parts, rate_c /= parts;
            for (int i = 1; i < parts; ++i) split<B, C>(rate_b, rate_c, 1);
        }
        turn<B>(rate_b);
        turn<C>(rate_c);
        turn<B>(rate_b);
    }
};

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
    most_rate_ = std::max(16 * rate_b_ * rate_b_, 4 * rate_c_ * rate_c_) / (kMostTurn * kMostTurn);
}

Eigen::Quaterniond FreeRotation::advance(const Eigen::Quaterniond& body_to_world,
                                         const Eigen::Vector3d& angular_momentum_world) const noexcept {
    const Eigen::Quaterniond& q = body_to_world;
    const Eigen::Vector3d m = q.conjugate() * angular_momentum_world;
    Turning body{q.w(), {q.x(), q.y(), q.z()}, {m.x(), m.y(), m.z()}};
    const double wanted = m.squaredNorm() * most_rate_;  // its square
    const int parts =
        !(wanted >= 1) ? 1 : static_cast<int>(std::sqrt(std::min(kMostParts * kMostParts, wanted))) + 1;
    if (rate_b_ == 0 && rate_c_ == 0) {
        // A sphere: the turn about the momentum is all.
    } else if (reference_ == 0) {
        body.split<1, 2>(rate_b_, rate_c_, parts);
    } else if (reference_ == 1) {
        body.split<2, 0>(rate_b_, rate_c_, parts);
    } else {
        body.split<0, 1>(rate_b_, rate_c_, parts);
    }

    const Eigen::Vector3d half_turn = world_rate_ * angular_momentum_world;
    const EvenParts even = even_parts(half_turn.squaredNorm());
    const Eigen::Vector3d v = even.sinc * half_turn, u(body.v[0], body.v[1], body.v[2]);
    const double w = even.cosine * body.w - v.dot(u);
    const Eigen::Vector3d turned = even.cosine * u + body.w * v + v.cross(u);
    // One Newton step towards unit length: it is off by rounding only, unless the input was.
    const double n = w * w + turned.squaredNorm();
    const double scale = std::abs(n - 1) < 1e-7 ? 1.5 - 0.5 * n : 1 / std::sqrt(n);
    return Eigen::Quaterniond(scale * w, scale * turned.x(), scale * turned.y(), scale * turned.z());
}

}  // namespace sim
