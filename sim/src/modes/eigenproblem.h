#pragma once
#include <Eigen/Core>

#include "modes/finite_element.h"

namespace sim {

/// Lowest solutions of one parity class, the rigid motion left out exactly (deflated, not sorted away).
struct ParitySolution {
    Eigen::VectorXd eigenvalues;  ///< ascending
    Eigen::MatrixXd vectors;      ///< columns x with x^T M x = 1
    double rigid_eigenvalue = 0;  ///< r^T K r / r^T M r of the rigid motion r, if the class has one
    bool complete = true;         ///< there are no more of finite frequency
};

/// Solves M x = theta (K + s M) x for the largest theta = 1 / (lambda + s), s = `shift` > 0, which stands a
/// mass matrix that is singular. Up to 150 unknowns dense (Eigen), all solutions; above that sparse
/// Cholesky and Lanczos (Spectra), at least `wanted` of them, with the inertia of K - sigma M as proof that
/// none is missed, as Lanczos may of a degenerate pair. Throws std::runtime_error.
[[nodiscard]] ParitySolution lowest_solutions(const ParityProblem& problem, double shift, int wanted);

}  // namespace sim
