#pragma once
#include <Eigen/Core>
#include <cmath>
#include <concepts>
#include <cstring>

namespace tracking {

/// A value for each of the axes x, y, z in lanes that the processor works on together; the fourth is unused.
using Lanes = Eigen::Array4d;

[[nodiscard]] inline Lanes to_lanes(const Eigen::Vector3d& v) noexcept {
    // In a register: Eigen's constructor goes through memory in a way that stalls the load (5 ns).
    using Packet = double __attribute__((vector_size(32)));
    const Packet packet{v.x(), v.y(), v.z(), 0};
    Lanes lanes;
    std::memcpy(lanes.data(), &packet, sizeof packet);
    return lanes;
}

/// F(dt) of one axis' state [position, velocity, acceleration], upper triangular:
///
///   [1 pv pa]
///   [0 vv va]
///   [0  0 aa]
struct Transition {
    double pv, pa, vv, va, aa;

    [[nodiscard]] Eigen::Matrix3d matrix() const {
        Eigen::Matrix3d f;
        f << 1, pv, pa, 0, vv, va, 0, 0, aa;
        return f;
    }
};

/// Position, velocity and acceleration of the three axes.
struct AxisStates {
    Lanes p = Lanes::Zero(), v = Lanes::Zero(), a = Lanes::Zero();

    /// Sums of all entries, lane by lane: not finite if an entry is not.
    [[nodiscard]] Lanes sum() const noexcept { return p + v + a; }
    [[nodiscard]] bool is_finite() const noexcept { return std::isfinite(sum().sum()); }
};

[[nodiscard]] inline AxisStates operator*(const Transition& f, const AxisStates& x) noexcept {
    return {x.p + f.pv * x.v + f.pa * x.a, f.vv * x.v + f.va * x.a, f.aa * x.a};
}

/// Symmetric 3x3 matrix over [p, v, a] by its six entries, so that it stays symmetric. T is double where the
/// axes share it, Lanes where each has its own.
template <typename T>
struct AxisMatrix {
    T pp, pv, pa, vv, va, aa;

    [[nodiscard]] Eigen::Matrix3d matrix() const requires std::same_as<T, double> {
        Eigen::Matrix3d m;
        m << pp, pv, pa, pv, vv, va, pa, va, aa;
        return m;
    }
};

/// F P F^T + Q (Friedmann 1992, 3.10).
template <typename T>
[[nodiscard]] inline AxisMatrix<T> propagated(const AxisMatrix<T>& p, const Transition& f,
                                              const AxisMatrix<double>& q) noexcept {
    const T row_pv = p.pv + (f.pv * p.vv + f.pa * p.va);
    const T row_pa = p.pa + (f.pv * p.va + f.pa * p.aa);
    const T row_va = f.vv * p.va + f.va * p.aa;
    return {(p.pp + q.pp + (f.pv * p.pv + f.pa * p.pa)) + (f.pv * row_pv + f.pa * row_pa),
            f.vv * row_pv + (f.va * row_pa + q.pv),
            f.aa * row_pa + q.pa,
            f.vv * (f.vv * p.vv + f.va * p.va) + (f.va * row_va + q.vv),
            f.aa * row_va + q.va,
            f.aa * f.aa * p.aa + q.aa};
}

/// K of a measured position, H = [1 0 0].
template <typename T>
struct AxisGain {
    T p, v, a;
};

/// Some roundings of a product of doubles.
inline constexpr double kRounding = 0x1p-48;

/// Takes a position of variance r into account: K = P H^T / s with s = P_pp + r (3.5), then (3.9), entry by
/// entry as (s P - P H^T H P) / s:
///
///   first row   r P_p. / s, where s P_p. - P_pp P_p. is r P_p. without cancellation
///   the rest    (s P_ij - P_pi P_pj) / s, where s P_ii is taken kRounding larger: more than the products'
///               rounding, so that what this leaves of a nearly singular P is no less than positive
///
/// The conditional covariance of v and a given p, which a measured p must leave alone, keeps its relative
/// accuracy of a few roundings of P, as in Joseph's form; and everything but a product waits for the division
/// only. Positive over 1e8 updates with dt from 1e-5 to 1 s and r from 1e-12 to 1e6 mm^2 (tested).
template <typename T>
inline AxisGain<T> correct(AxisMatrix<T>& p, double r) noexcept {
    const T s = p.pp + r;
    const T more = s * (1 + kRounding);
    const T share = 1 / s;
    const T keep = r * share;
    const AxisGain<T> k{p.pp * share, p.pv * share, p.pa * share};
    p = {p.pp * keep,
         p.pv * keep,
         p.pa * keep,
         (p.vv * more - p.pv * p.pv) * share,
         (p.va * s - p.pv * p.pa) * share,
         (p.aa * more - p.pa * p.pa) * share};
    return k;
}

/// x + K innovation.
template <typename T>
inline void add(AxisStates& x, const AxisGain<T>& k, const Lanes& innovation) noexcept {
    x.p += k.p * innovation;
    x.v += k.v * innovation;
    x.a += k.a * innovation;
}

}  // namespace tracking
