#include "modes/modal_basis.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <random>

#include "modes/linear_body.h"
#include "sim/modes.h"

namespace sim {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

const Material kRubber{1e6, 0.3, 600};

ModalBasis modes_of(const Superquadric& shape, int elements, int count) {
    return free_vibration_modes({shape, ModeDomain::superquadric, kRubber, elements, count}).basis;
}

class Random {
public:
    explicit Random(unsigned seed) : rng_(seed) {}
    double operator()(double low, double high) {
        return low + (high - low) * static_cast<double>(rng_()) / 4294967296.0;
    }
    Vector3d vector(double reach) {
        return {(*this)(-reach, reach), (*this)(-reach, reach), (*this)(-reach, reach)};
    }
    VectorXd coordinates(int n) {
        VectorXd q(n);
        for (double& v : q) v = (*this)(-1, 1);
        return q;
    }
    Superquadric shape() {
        return {{(*this)(0.05, 0.4), (*this)(0.05, 0.4), (*this)(0.05, 0.4)},
                (*this)(0.1, 1.9),
                (*this)(0.1, 1.9)};
    }

private:
    std::mt19937 rng_;
};

TEST(UniformStrainBasis, OfASphereHasTheClosedFormsFrequenciesAndMass) {
    const double nu = 0.3, g = 1e6 / 2.6, lambda = 2 * g * nu / (1 - 2 * nu), r = 0.2;
    const ModalBasis basis = uniform_strain_basis({Vector3d::Constant(r), 1, 1}, kRubber);
    const double unit = 5 / (600 * r * r);  // volume over second moment of mass
    for (int k = 0; k < 5; ++k) EXPECT_NEAR(basis.omega[k] * basis.omega[k] / (2 * g * unit), 1, 1e-12);
    EXPECT_NEAR(basis.omega[5] * basis.omega[5] / ((3 * lambda + 2 * g) * unit), 1, 1e-12);
    const RigidMass mass = rigid_mass({Vector3d::Constant(r), 1, 1}, kRubber);
    EXPECT_NEAR(mass.mass, 600 * 4 * M_PI / 3 * r * r * r, 1e-12);
    EXPECT_LT((mass.inertia / (0.4 * mass.mass * r * r) - Vector3d::Ones()).norm(), 1e-12);
}

TEST(UniformStrainBasis, IsLinearBodysByAscendingFrequency) {
    Random random(1);
    for (int i = 0; i < 20; ++i) {
        const Superquadric shape = random.shape();
        const ModalBasis basis = uniform_strain_basis(shape, kRubber);
        const LinearBody body = make_linear_body(Gauge(shape), kRubber);
        EXPECT_EQ(basis.count(), 6);
        Vector6d sorted = body.omega;
        std::sort(sorted.begin(), sorted.end());
        EXPECT_EQ(basis.omega, sorted);
        const Vector3d r = random.vector(0.3).cwiseProduct(shape.semi_axes);
        for (int k = 0; k < 6; ++k) {
            const Displacement u = displacement_at(basis, basis.nodal.col(k), r);
            EXPECT_LT((u.gradient * r - u.value).norm(), 1e-13 * u.gradient.norm());
            Vector6d strain;
            const Eigen::Matrix3d& e = u.gradient;
            strain << e(0, 0), e(1, 1), e(2, 2), e(1, 2), e(0, 2), e(0, 1);
            const Vector6d modal = body.modal_from_strain * strain;  // one of them is 1 or -1
            Eigen::Index which = 0;
            EXPECT_NEAR(modal.cwiseAbs().maxCoeff(&which), 1, 1e-12);
            EXPECT_NEAR(modal.norm(), 1, 1e-12);
            EXPECT_NEAR(body.omega[which] / basis.omega[k], 1, 1e-12);
        }
    }
}

/// Rigid motions, mass-normalised with the closed forms, and after them all modes of one element: every
/// displacement that the element can have.
MatrixXd everything(const Superquadric& shape, const ModalBasis& modes) {
    const RigidMass mass = rigid_mass(shape, kRubber);
    MatrixXd all(81, 81);
    for (int a = 0; a < 27; ++a) {
        const Vector3d r = Vector3d(a % 3 - 1, a / 3 % 3 - 1, a / 9 - 1).cwiseProduct(shape.semi_axes);
        for (int i = 0; i < 3; ++i) {
            all.block<3, 1>(3 * a, i) = Vector3d::Unit(i) / std::sqrt(mass.mass);
            all.block<3, 1>(3 * a, 3 + i) = Vector3d::Unit(i).cross(r) / std::sqrt(mass.inertia[i]);
        }
    }
    all.rightCols<75>() = modes.nodal;
    return all;
}

// Rayleigh-Ritz on the six uniform strains, with the mass and stiffness that the modes know.
TEST(ModalBody, TruncatedToUniformStrainsAgreesWithTheLinearBodyTo1em9) {
    Random random(2);
    for (int i = 0; i < 20; ++i) {
        const Superquadric shape = random.shape();
        const ModalBasis modes = modes_of(shape, 1, 75), linear = uniform_strain_basis(shape, kRubber);
        const MatrixXd part = everything(shape, modes).partialPivLu().solve(linear.nodal);
        const MatrixXd mass = part.transpose() * part;
        const MatrixXd bent = modes.omega.asDiagonal() * part.bottomRows<75>();
        const MatrixXd stiffness = bent.transpose() * bent;
        // The quadrature's 1e-10, over frequencies that differ by 10.
        EXPECT_LT((mass - MatrixXd::Identity(6, 6)).cwiseAbs().maxCoeff(), 1e-9);
        const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> ritz(stiffness, mass);
        EXPECT_LT((ritz.eigenvalues().cwiseSqrt().cwiseQuotient(linear.omega).array() - 1).abs().maxCoeff(),
                  1e-9);
        EXPECT_LE(modes.omega[0], linear.omega[0] * (1 + 1e-9)) << "the element can do better";
    }
}

TEST(ModeShapes, AtTheNodesAreTheNodalValuesAndOutsideTheBordersTheBorders) {
    const Superquadric shape{{0.3, 0.2, 0.5}, 1, 1};
    for (const int k : {1, 2, 3}) {
        const ModalBasis basis = modes_of(shape, k, 12);
        const int m = 2 * k + 1;
        for (int node = 0; node < m * m * m; ++node) {
            const Vector3d at(node % m, node / m % m, node / m / m);
            const Vector3d r = (at / k - Vector3d::Ones()).cwiseProduct(shape.semi_axes);
            const MatrixXd nodal = basis.nodal.middleRows(3 * node, 3);
            EXPECT_LT((mode_shapes_at(basis, r) - nodal).norm(), 1e-13 * basis.nodal.norm());
        }
        const Vector3d outside(0.4, 0.1, -0.9), border(0.3, 0.1, -0.5);
        EXPECT_EQ(mode_shapes_at(basis, outside), mode_shapes_at(basis, border));
        const VectorXd nodal = basis.nodal.col(3);
        EXPECT_EQ(displacement_at(basis, nodal, outside).value, displacement_at(basis, nodal, border).value);
        EXPECT_EQ(displacement_at(basis, nodal, outside).gradient.col(0).norm(), 0);
        EXPECT_GT(displacement_at(basis, nodal, outside).gradient.col(1).norm(), 0);
        // A surface sample on the border, or a rounding outside, has the body's own gradient.
        const Vector3d pole(0.3, 0, 0), rounded(0.3 * (1 + 1e-15), 0, 0);
        EXPECT_GT(displacement_at(basis, basis.nodal.col(0), rounded).gradient.col(0).norm(), 0);
        EXPECT_EQ(displacement_at(basis, nodal, rounded).value, displacement_at(basis, nodal, pole).value);
    }
}

TEST(Displacement, IsTheSumOfTheModesAndItsGradientTheDifferenceQuotient) {
    Random random(3);
    const Superquadric shape{{0.3, 0.2, 0.5}, 1, 1};
    for (const int k : {1, 2, 3}) {
        const ModalBasis basis = modes_of(shape, k, 20);
        for (int i = 0; i < 200; ++i) {
            const VectorXd q = random.coordinates(20), nodal = basis.nodal * q;
            const Vector3d r = random.vector(0.98).cwiseProduct(shape.semi_axes);
            const Displacement u = displacement_at(basis, nodal, r);
            EXPECT_LT((u.value - mode_shapes_at(basis, r) * q).norm(), 1e-13 * nodal.norm());
            // Central differences of quadratics are exact but for rounding, unless an element's border is
            // between.
            const double h = 1e-6,
                         nearest_border = ((r.cwiseQuotient(shape.semi_axes) + Vector3d::Ones()) * k / 2)
                                              .unaryExpr([](double x) { return std::abs(x - std::round(x)); })
                                              .minCoeff();
            if (nearest_border < 1e-3) continue;
            for (int axis = 0; axis < 3; ++axis) {
                const Vector3d step = h * Vector3d::Unit(axis);
                const Vector3d difference = displacement_at(basis, nodal, r + step).value -
                                            displacement_at(basis, nodal, r - step).value;
                EXPECT_LT((difference / (2 * h) - u.gradient.col(axis)).norm(),
                          1e-8 * u.gradient.norm() + 1e-8);
            }
        }
    }
}

/// Largest spectral norm of the gradient at a grid of points.
double largest_gradient(const ModalBasis& basis, const VectorXd& nodal) {
    double largest = 0;
    for (int i = 0; i < 1000; ++i) {
        const Vector3d unit(i % 10 / 4.5 - 1, i / 10 % 10 / 4.5 - 1, i / 100 / 4.5 - 1);
        const Eigen::Matrix3d g =
            displacement_at(basis, nodal, unit.cwiseProduct(basis.half_extents)).gradient;
        largest = std::max(largest, Eigen::JacobiSVD<Eigen::Matrix3d>(g).singularValues()[0]);
    }
    return largest;
}

struct InverseTally {
    int most_iterations = 0, fallbacks = 0;
    double worst_miss = 0;  ///< |r + u(r) - x| over the size
};

InverseTally invert(const Superquadric& shape, int elements, int count, double gradient, unsigned seed) {
    Random random(seed);
    const ModalBasis basis = modes_of(shape, elements, count);
    InverseTally tally;
    for (int i = 0; i < 30; ++i) {
        VectorXd nodal = basis.nodal * random.coordinates(count).cwiseQuotient(basis.omega);
        nodal *= gradient / largest_gradient(basis, nodal);
        for (int j = 0; j < 50; ++j) {
            const Vector3d r = random.vector(1).cwiseProduct(shape.semi_axes);
            const Vector3d x = r + displacement_at(basis, nodal, r).value;
            const InversePoint found = inverse_displacement(basis, nodal, x);
            const Vector3d back = found.r + displacement_at(basis, nodal, found.r).value;
            tally.worst_miss =
                std::max(tally.worst_miss, (back - x).norm() / (2 * shape.semi_axes.maxCoeff()));
            tally.most_iterations = std::max(tally.most_iterations, found.iterations);
            tally.fallbacks += found.fallback;
        }
    }
    return tally;
}

TEST(InverseDisplacement, TakesAtMost6IterationsForGradientsUnder0p3) {
    int seed = 10;
    for (const Superquadric& shape :
         {Superquadric{{1, 1, 1}, 1, 1}, {{0.3, 0.2, 0.5}, 0.1, 1}, {{0.1, 0.4, 0.4}, 0.1, 0.1}})
        for (const int k : {1, 2, 3})
            for (const int count : {6, 12, 45}) {
                const InverseTally tally = invert(shape, k, count, 0.299, seed++);
                EXPECT_LE(tally.most_iterations, 6) << k << ' ' << count;
                EXPECT_EQ(tally.fallbacks, 0);
                EXPECT_LT(tally.worst_miss, 1e-12);
            }
}

TEST(InverseDisplacement, OfALinearBodyTakesOneIteration) {
    Random random(4);
    const ModalBasis basis = uniform_strain_basis({{0.3, 0.2, 0.5}, 1, 1}, kRubber);
    VectorXd nodal = basis.nodal * random.coordinates(6);
    nodal *= 0.25 / largest_gradient(basis, nodal);
    const Eigen::Matrix3d d =
        Eigen::Matrix3d::Identity() + displacement_at(basis, nodal, Vector3d::Zero()).gradient;
    for (int i = 0; i < 100; ++i) {
        const Vector3d r = random.vector(0.7).cwiseProduct(basis.half_extents);
        const InversePoint found = inverse_displacement(basis, nodal, d * r);
        EXPECT_LT((found.r - r).norm(), 1e-13);
        EXPECT_LE(found.iterations,
                  (d * r).cwiseQuotient(basis.half_extents).cwiseAbs().maxCoeff() < 1 ? 1 : 2);
    }
}

// Folded space: some points have no inverse, others several.
TEST(InverseDisplacement, OfFoldedSpaceStaysFiniteAndSaysWhenItFellBack) {
    Random random(5);
    const ModalBasis basis = modes_of({{1, 1, 1}, 1, 1}, 1, 12);
    int fallbacks = 0;
    for (int i = 0; i < 200; ++i) {
        VectorXd nodal = basis.nodal * random.coordinates(12);
        nodal *= random(0.5, 4) / largest_gradient(basis, nodal);
        const Vector3d x = random.vector(2);
        const InversePoint found = inverse_displacement(basis, nodal, x);
        EXPECT_TRUE(found.r.allFinite() && found.gradient.allFinite());
        const double miss = (found.r + displacement_at(basis, nodal, found.r).value - x).norm();
        EXPECT_TRUE(found.fallback || miss < 2e-12);
        fallbacks += found.fallback;
    }
    EXPECT_GT(fallbacks, 0);
    const VectorXd zero = VectorXd::Zero(81);
    const InversePoint broken = inverse_displacement(basis, zero, Vector3d(std::nan(""), 0, 0));
    EXPECT_TRUE(broken.fallback);
}

}  // namespace
}  // namespace sim
