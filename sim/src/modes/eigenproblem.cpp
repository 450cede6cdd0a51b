#include "modes/eigenproblem.h"

#include <Spectra/SymGEigsShiftSolver.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Householder>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

namespace sim {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Factor = Eigen::SimplicialLDLT<Sparse>;

constexpr int kDenseUnknowns = 150;
constexpr double kNoMass = 1e-12;  // of the largest theta: below, a function of massless space

double rigid_eigenvalue(const ParityProblem& problem) {
    if (problem.rigid.size() == 0) return 0;
    return problem.rigid.dot(problem.stiffness * problem.rigid) /
           problem.rigid.dot(problem.mass * problem.rigid);
}

// Turns the coordinates so that the unit vector of `rigid` becomes the first axis; returns the turn.
Eigen::MatrixXd rigid_first(const Eigen::VectorXd& rigid) {
    const Eigen::Index n = rigid.size();
    Eigen::VectorXd normal = rigid.normalized();
    normal[0] += normal[0] < 0 ? -1 : 1;
    return Eigen::MatrixXd::Identity(n, n) - 2 / normal.squaredNorm() * normal * normal.transpose();
}

ParitySolution solve_dense(const ParityProblem& problem, double shift) {
    const Eigen::MatrixXd mass = problem.mass, stiffness = problem.stiffness;
    const Eigen::LLT<Eigen::MatrixXd> factor(stiffness + shift * mass);
    if (factor.info() != Eigen::Success)
        throw std::runtime_error("vibration modes: the stiffness is not positive definite");
    // theta y = L^-1 M L^-T y, x = L^-T y
    Eigen::MatrixXd inverse = factor.matrixL().solve(mass);
    inverse = factor.matrixL().solve(inverse.transpose().eval());
    Eigen::MatrixXd turn = Eigen::MatrixXd::Identity(mass.rows(), mass.rows());
    Eigen::Index first = 0;
    if (problem.rigid.size() > 0) {
        turn = rigid_first(factor.matrixU() * problem.rigid);
        inverse = (turn * inverse * turn).eval();
        first = 1;
    }
    const Eigen::Index n = mass.rows() - first;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(inverse.bottomRightCorner(n, n));
    if (solver.info() != Eigen::Success)
        throw std::runtime_error("vibration modes: the eigenproblem has no solution");
    const Eigen::VectorXd theta = solver.eigenvalues().reverse();
    const Eigen::Index kept = (theta.array() > kNoMass / shift).count();
    ParitySolution solution;
    solution.eigenvalues = theta.head(kept).cwiseInverse().array() - shift;
    const Eigen::MatrixXd y = turn.rightCols(n) * solver.eigenvectors().rowwise().reverse().leftCols(kept);
    solution.vectors = factor.matrixU().solve(y);
    solution.vectors *= theta.head(kept).cwiseSqrt().cwiseInverse().asDiagonal();
    return solution;
}

// y = (K + s M)^-1 x without its parts along `found` (M-orthonormal, solutions themselves).
class DeflatedInverse {
public:
    using Scalar = double;
    DeflatedInverse(const Factor& factor, const Sparse& mass, const Eigen::MatrixXd& found)
        : factor_(factor), mass_(mass), found_(found) {}
    [[nodiscard]] Eigen::Index rows() const { return mass_.rows(); }
    [[nodiscard]] Eigen::Index cols() const { return mass_.cols(); }
    void set_shift(double) {}
    void perform_op(const double* in, double* out) const {
        Eigen::Map<Eigen::VectorXd> result(out, rows());
        result = factor_.solve(Eigen::Map<const Eigen::VectorXd>(in, rows()));
        for (int pass = 0; pass < 2; ++pass)
            result -= (found_ * (found_.transpose() * (mass_ * result))).eval();
    }

private:
    const Factor& factor_;
    const Sparse& mass_;
    const Eigen::MatrixXd& found_;
};

class MassProduct {
public:
    using Scalar = double;
    explicit MassProduct(const Sparse& mass) : mass_(mass) {}
    [[nodiscard]] Eigen::Index rows() const { return mass_.rows(); }
    [[nodiscard]] Eigen::Index cols() const { return mass_.cols(); }
    void perform_op(const double* in, double* out) const {
        Eigen::Map<Eigen::VectorXd>(out, rows()) = mass_ * Eigen::Map<const Eigen::VectorXd>(in, rows());
    }

private:
    const Sparse& mass_;
};

class SparseSolver {
public:
    SparseSolver(const ParityProblem& problem, double shift)
        : problem_(problem), shift_(shift), factor_(problem.stiffness + shift * problem.mass) {
        if (factor_.info() != Eigen::Success)
            throw std::runtime_error("vibration modes: the stiffness is not positive definite");
        found_.resize(problem.mass.rows(), rigid_motions());
        if (problem.rigid.size() > 0)
            found_.col(0) = problem.rigid / std::sqrt(problem.rigid.dot(problem.mass * problem.rigid));
    }

    ParitySolution run(int wanted) {
        constexpr int kSearches = 8;
        search(wanted);
        const double sigma = (1 + 1e-7) * *std::max_element(eigenvalues_.begin(), eigenvalues_.end());
        const int there = count_below(sigma);
        for (int i = 0; i < kSearches && found_below(sigma) < there; ++i) search(there - found_below(sigma));
        if (found_below(sigma) != there)
            throw std::runtime_error("vibration modes: Lanczos found " + std::to_string(found_below(sigma)) +
                                     " of " + std::to_string(there) + " solutions");
        return sorted();
    }

private:
    // Finds `count` more solutions, the lowest first, and adds them to those found.
    void search(int count) {
        const int room = static_cast<int>(problem_.mass.rows() - found_.cols());
        const int lanczos = std::min(room, std::max(2 * count + 10, 30));
        DeflatedInverse inverse(factor_, problem_.mass, found_);
        MassProduct mass(problem_.mass);
        Spectra::SymGEigsShiftSolver<DeflatedInverse, MassProduct, Spectra::GEigsMode::ShiftInvert> solver(
            inverse, mass, count, lanczos, -shift_);
        solver.init();
        solver.compute(Spectra::SortRule::LargestMagn, 1000, 1e-14);
        if (solver.info() != Spectra::CompInfo::Successful)
            throw std::runtime_error("vibration modes: Lanczos does not converge");
        add(solver.eigenvectors(count));
    }

    // Once more through the inverse, which removes what has no mass; orthonormal; Rayleigh quotients.
    void add(const Eigen::MatrixXd& vectors) {
        for (Eigen::Index i = 0; i < vectors.cols(); ++i) {
            Eigen::VectorXd x = factor_.solve(problem_.mass * vectors.col(i));
            for (int pass = 0; pass < 2; ++pass)
                x -= (found_ * (found_.transpose() * (problem_.mass * x))).eval();
            x /= std::sqrt(x.dot(problem_.mass * x));
            eigenvalues_.push_back(x.dot(problem_.stiffness * x));
            found_.conservativeResize(Eigen::NoChange, found_.cols() + 1);
            found_.rightCols<1>() = x;
        }
    }

    // Sylvester: as many eigenvalues lie below sigma as pivots of K - sigma M are negative. The rigid
    // motion is one of them.
    [[nodiscard]] int count_below(double sigma) const {
        const Factor inertia(problem_.stiffness - sigma * problem_.mass);
        if (inertia.info() != Eigen::Success)
            throw std::runtime_error("vibration modes: the inertia of the stiffness cannot be computed");
        return static_cast<int>((inertia.vectorD().array() < 0).count() - rigid_motions());
    }
    [[nodiscard]] int found_below(double sigma) const {
        return static_cast<int>(std::count_if(eigenvalues_.begin(), eigenvalues_.end(),
                                              [sigma](double value) { return value < sigma; }));
    }
    [[nodiscard]] Eigen::Index rigid_motions() const { return problem_.rigid.size() > 0 ? 1 : 0; }

    [[nodiscard]] ParitySolution sorted() const {
        std::vector<int> order(eigenvalues_.size());
        for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
        std::sort(order.begin(), order.end(), [this](int a, int b) {
            return std::pair(eigenvalues_[a], a) < std::pair(eigenvalues_[b], b);
        });
        ParitySolution solution;
        solution.eigenvalues.resize(static_cast<Eigen::Index>(order.size()));
        solution.vectors.resize(found_.rows(), static_cast<Eigen::Index>(order.size()));
        for (Eigen::Index i = 0; i < solution.eigenvalues.size(); ++i) {
            solution.eigenvalues[i] = eigenvalues_[order[i]];
            solution.vectors.col(i) = found_.col(rigid_motions() + order[i]);
        }
        solution.complete = false;
        return solution;
    }

    const ParityProblem& problem_;
    double shift_;
    Factor factor_;
    Eigen::MatrixXd found_;  // the rigid motion first
    std::vector<double> eigenvalues_;
};

}  // namespace

ParitySolution lowest_solutions(const ParityProblem& problem, double shift, int wanted) {
    ParitySolution solution = problem.mass.rows() <= kDenseUnknowns
                                  ? solve_dense(problem, shift)
                                  : SparseSolver(problem, shift).run(wanted);
    solution.rigid_eigenvalue = rigid_eigenvalue(problem);
    return solution;
}

}  // namespace sim
