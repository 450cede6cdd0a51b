#pragma once
#include <Eigen/Core>
#include <vector>

#include "sim/geometry.h"

namespace sim {

/// Elements of one axis that reach into x >= 0, in units of the half extent: cell c covers [lower, upper] of
/// element `element`. With an odd number of elements the first cell is half an element.
struct OctantAxis {
    int elements;
    [[nodiscard]] int cells() const noexcept { return (elements + 1) / 2; }  ///< number
    [[nodiscard]] int element(int cell) const noexcept { return elements / 2 + cell; }
    [[nodiscard]] double upper(int cell) const noexcept { return 2.0 * (element(cell) + 1) / elements - 1; }
    [[nodiscard]] double lower(int cell) const noexcept { return cell == 0 ? 0 : upper(cell - 1); }
    /// Local coordinate, -1 to 1, of `x` in the cell's element.
    [[nodiscard]] double local(int cell, double x) const noexcept {
        return (x + 1) * elements - 2 * element(cell) - 1;
    }
};

/// Points and weights for polynomials of degree 4 in each coordinate over one cell's matter. Points are in
/// the element's local coordinates, weights in units of the octant's box: those of a whole box's cells add up
/// to 1.
struct CellRule {
    Eigen::Matrix3Xd points;
    Eigen::VectorXd weights;
};

/// Rules of all cells, cell (i, j, k) at i + cells (j + cells k).
using OctantRule = std::vector<CellRule>;

/// 3x3x3 Gauss points a cell: exact.
[[nodiscard]] OctantRule box_rule(int elements);

/// Matter is the superquadric that fills the box. 125 points a cell; their weights integrate the Lagrange
/// polynomials through them, found by iterated integration: Gauss along z, where it is exact, and tanh-sinh
/// along x and y between all places where the surface crosses an element's border. Volume
/// and second moments are right to 1e-10 for exponents 0.1 to 1.9. Cost 0.3 ms for one element, 3 ms for four
/// a side, 25 ms for seven.
[[nodiscard]] OctantRule superquadric_rule(const Superquadric& shape, int elements);

}  // namespace sim
