#pragma once
#include <Eigen/Core>
#include <cmath>
#include <concepts>

namespace tracking {

/// A value for each of the axes x, y, z in lanes that the processor works on together; the fourth is unused.
using Lanes = Eigen::Array4d;

[[nodiscard]] inline Lanes to_lanes(const Eigen::Vector3d& v) noexcept {
    return {v.x(), v.y(), v.z(), 0};
}

/// F(dt) of one axis' state [position, velocity, acceleration], upper triangular:
///
///   [1 pv pa]
///   [0  1 va]
///   [0  0 aa]
struct Transition {
    double pv, pa, va, aa;

    [[nodiscard]] Eigen::Matrix3d matrix() const {
        Eigen::Matrix3d f;
        f << 1, pv, pa, 0, 1, va, 0, 0, aa;
        return f;
    }
};

/// Position, velocity and acceleration of the three axes.
struct AxisStates {
    Lanes p = Lanes::Zero(), v = Lanes::Zero(), a = Lanes::Zero();

    [[nodiscard]] bool is_finite() const noexcept { return std::isfinite((p + v + a).sum()); }
};

[[nodiscard]] inline AxisStates operator*(const Transition& f, const AxisStates& x) noexcept {
    return {x.p + f.pv * x.v + f.pa * x.a, x.v + f.va * x.a, f.aa * x.a};
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
    const T row_pp = p.pp + f.pv * p.pv + f.pa * p.pa;
    const T row_pv = p.pv + f.pv * p.vv + f.pa * p.va;
    const T row_pa = p.pa + f.pv * p.va + f.pa * p.aa;
    const T row_vv = p.vv + f.va * p.va;
    const T row_va = p.va + f.va * p.aa;
    return {row_pp + f.pv * row_pv + f.pa * row_pa + q.pp,
            row_pv + f.va * row_pa + q.pv,
            f.aa * row_pa + q.pa,
            row_vv + f.va * row_va + q.vv,
            f.aa * row_va + q.va,
            f.aa * f.aa * p.aa + q.aa};
}

/// K of a measured position, H = [1 0 0].
template <typename T>
struct AxisGain {
    T p, v, a;
};

/// Takes a position of variance r into account: K = P H^T / (H P H^T + r) (3.5), then
/// P <- (I - K H) P (I - K H)^T + K r K^T, which is (3.9) in Joseph's form: symmetric and positive under
/// rounding. 1 - K_p is formed as r / (P_pp + r), without cancellation.
template <typename T>
inline AxisGain<T> correct(AxisMatrix<T>& p, double r) noexcept {
    const T share = 1 / (p.pp + r);
    const AxisGain<T> k{p.pp * share, p.pv * share, p.pa * share};
    const T keep = r * share;
    const T pv = p.pv - k.v * p.pp;  // second and third row of (I - K H) P
    const T pa = p.pa - k.a * p.pp;
    const T vv = p.vv - k.v * p.pv;
    const T va = p.va - k.v * p.pa;
    const T aa = p.aa - k.a * p.pa;
    p = {keep * keep * p.pp + r * k.p * k.p, keep * pv + r * k.p * k.v,     keep * pa + r * k.p * k.a,
         vv - k.v * pv + r * k.v * k.v,      va - k.a * pv + r * k.v * k.a, aa - k.a * pa + r * k.a * k.a};
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
