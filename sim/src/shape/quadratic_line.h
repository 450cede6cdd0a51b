#pragma once
#include <Eigen/Core>
#include <cmath>

namespace sim {

/// The quadratic Lagrange functions of the nodes -1, 0, 1 at t, with their slopes.
struct QuadraticLine {
    Eigen::Vector3d value, slope;
};

inline QuadraticLine quadratic_line(double t) noexcept {
    return {{0.5 * t * (t - 1), (1 - t) * (1 + t), 0.5 * t * (t + 1)}, {t - 0.5, -2 * t, t + 0.5}};
}

/// Place of one coordinate in a row of elements, each from -1 to 1.
struct ElementPlace {
    int element;
    double local;    ///< -1 to 1
    bool at_border;  ///< the coordinate lay outside and was moved to the border
};

/// `normalized`: coordinate over half extent, -1 to 1 inside; a place that is no number counts as -1.
inline ElementPlace locate(double normalized, int elements) noexcept {
    const double inside = normalized > -1 ? (normalized < 1 ? normalized : 1) : -1;
    const double along = (inside + 1) * 0.5 * elements;
    const int element = std::min(elements - 1, static_cast<int>(along));
    // A surface sample a rounding outside is inside.
    return {element, 2 * (along - element) - 1, !(std::abs(normalized) <= 1 + 1e-9)};
}

}  // namespace sim
