#pragma once
#include <Eigen/Core>
#include <type_traits>

#include "shape/lanes.h"

namespace sim {

/// A displacement as the modal shape polynomial of (2.10) in one brick's coordinates xi in [-1, 1]^3:
///   u(xi) = sum over a, b, c in 0..2 of  C[9 c + 3 b + a] xi^a eta^b zeta^c,   each C three components.
/// `coefficients` holds 27 rows of 3 floats (x, y, z).
template <typename T>
struct PolynomialValue {
    T u[3];
    T gradient[3][3];  ///< du_i / dxi_j
};

namespace detail {
template <typename T>
[[nodiscard]] inline T broadcast(float value) noexcept {
    if constexpr (std::is_same_v<T, float>) {
        return value;
    } else {
        return lanes_of(value);
    }
}
}  // namespace detail

/// By Horner's rule along each axis in turn: 26 multiply-adds for the value of a component, 45 for its
/// gradient. T is float (one point) or Lanes (eight).
template <typename T>
[[nodiscard]] inline PolynomialValue<T> evaluate_polynomial(const float* coefficients, T x, T y,
                                                            T z) noexcept {
    using detail::broadcast;
    PolynomialValue<T> result;
    for (int i = 0; i < 3; ++i) {
        T plane[3], plane_x[3], plane_y[3];
        for (int c = 0; c < 3; ++c) {
            T line[3], line_x[3];
            for (int b = 0; b < 3; ++b) {
                const float* k = coefficients + 3 * (9 * c + 3 * b) + i;
                const T two = broadcast<T>(k[6]), one = broadcast<T>(k[3]);
                const T inner = two * x + one;
                line[b] = inner * x + broadcast<T>(k[0]);
                line_x[b] = two * x + inner;
            }
            const T inner = line[2] * y + line[1];
            plane[c] = inner * y + line[0];
            plane_y[c] = line[2] * y + inner;
            plane_x[c] = (line_x[2] * y + line_x[1]) * y + line_x[0];
        }
        const T inner = plane[2] * z + plane[1];
        result.u[i] = inner * z + plane[0];
        result.gradient[i][2] = plane[2] * z + inner;
        result.gradient[i][1] = (plane_y[2] * z + plane_y[1]) * z + plane_y[0];
        result.gradient[i][0] = (plane_x[2] * z + plane_x[1]) * z + plane_x[0];
    }
    return result;
}

/// The 27 monomials at a point, in the order of the coefficients.
inline void monomials(float x, float y, float z, float* m) noexcept {
    const float px[3] = {1, x, x * x}, py[3] = {1, y, y * y}, pz[3] = {1, z, z * z};
    for (int c = 0; c < 3; ++c)
        for (int b = 0; b < 3; ++b)
            for (int a = 0; a < 3; ++a) m[9 * c + 3 * b + a] = px[a] * py[b] * pz[c];
}

/// Coefficients of the polynomial through the 27 values of a brick's nodes (27 x 3, x fastest):
/// along an axis, from values at -1, 0, 1: c0 = v0, c1 = (v1 - v-1) / 2, c2 = (v1 + v-1) / 2 - v0.
[[nodiscard]] Eigen::Matrix<double, 27, 3> polynomial_from_nodes(const Eigen::Matrix<double, 27, 3>& nodes);

}  // namespace sim
