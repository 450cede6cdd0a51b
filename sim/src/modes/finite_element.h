#pragma once
#include <Eigen/SparseCore>
#include <vector>

#include "modes/cell_rule.h"
#include "sim/modes.h"

namespace sim {

/// Which of the eight independent problems: bit j of `index` says that the component u_j is even in its own
/// axis j and the other components odd in it. 0: stretching, 1, 2, 4: bending (with the translation along x,
/// y, z), 3, 5, 6: shear (with the rotation about z, y, x), 7: twisting.
struct ParityClass {
    int index;
    [[nodiscard]] bool odd(int component, int axis) const noexcept {
        return ((index >> axis) & 1) == (component == axis ? 0 : 1);
    }
};
constexpr int kParityClasses = 8;

/// K x = lambda M x of one parity class (2.1 without damping).
struct ParityProblem {
    Eigen::SparseMatrix<double> stiffness, mass;  ///< [N/m], [kg]
    Eigen::VectorXd rigid;                        ///< the class's rigid motion; no rows: it has none
};

/// Isotropic elasticity on elements^3 bricks of 27 nodes with consistent mass:
///   K = integral of lambda div u div v + 2 mu eps(u) : eps(v),   M = integral of rho u . v
/// by octant, cell by cell. With more than one element a side, brick space outside a superquadric is massless
/// and has 1e-8 of the stiffness: rigid motions stay exact, no unknown is free, and no mode lives there.
class FiniteElementModel {
public:
    FiniteElementModel(const Superquadric& shape, ModeDomain domain, const Material& material, int elements);

    [[nodiscard]] ParityProblem problem(ParityClass parity) const;  ///< K and M of the class
    [[nodiscard]] int unknowns(ParityClass parity) const;           ///< degrees of freedom of the class
    /// Nodal values, 3 (2 elements + 1)^3, of a solution of the class.
    [[nodiscard]] Eigen::VectorXd expand(ParityClass parity, const Eigen::VectorXd& solution) const;
    /// About the square of the lowest bending frequency of a compact body [rad^2/s^2].
    [[nodiscard]] double eigenvalue_scale() const noexcept { return scale_; }

private:
    struct CellMatrices {
        Eigen::MatrixXd stiffness;  ///< 81 x 81, row 3 node + component
        Eigen::MatrixXd mass;       ///< 27 x 27
    };
    /// Where a nodal value of the grid stands in a class's solution.
    struct Unknown {
        int index;    ///< -1: the value is zero
        double sign;  ///< -1: on the negative side of an odd function
    };

    [[nodiscard]] CellMatrices integrate(const CellRule& rule, const Material& material) const;
    [[nodiscard]] Unknown unknown(ParityClass parity, int component, const Eigen::Array3i& node) const;
    [[nodiscard]] std::vector<Unknown> cell_unknowns(ParityClass parity, int cell) const;
    [[nodiscard]] Eigen::VectorXd rigid_motion(ParityClass parity) const;

    Eigen::Vector3d half_extents_;
    OctantAxis axis_;
    double scale_;
    std::vector<CellMatrices> cells_;
};

}  // namespace sim
