#include "shape/shape_polynomial.h"

namespace sim {

Eigen::Matrix<double, 27, 3> polynomial_from_nodes(const Eigen::Matrix<double, 27, 3>& nodes) {
    Eigen::Matrix<double, 27, 3> c = nodes;
    for (const int stride : {1, 3, 9}) {
        for (int k = 0; k < 27; ++k) {
            if (k / stride % 3 != 0) continue;
            const Eigen::RowVector3d low = c.row(k), mid = c.row(k + stride), high = c.row(k + 2 * stride);
            c.row(k) = mid;
            c.row(k + stride) = (high - low) / 2;
            c.row(k + 2 * stride) = (high + low) / 2 - mid;
        }
    }
    return c;
}

}  // namespace sim
