#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "sim/modes.h"

namespace sim {
namespace {

using Eigen::Vector3d;

const Material kUnit{1, 0.3, 1};

ModesRequest box(const Vector3d& size, int elements, int count, const Material& material = kUnit) {
    return {{size / 2, 0.1, 0.1}, ModeDomain::box, material, elements, count};
}

/// Eigenvalues of free elastic boxes, computed independently: tests/reference/README.md.
nlohmann::json reference() {
    std::ifstream file(MUSICWORLD_SOURCE_DIR "/tests/reference/free_vibration_modes.json");
    return nlohmann::json::parse(file);
}

struct ReferenceBox {
    const char* name;
    Vector3d size;
};
const ReferenceBox kReferenceBoxes[] = {{"cube_nu0.3", {1, 1, 1}}, {"box123_nu0.3", {1, 2, 3}}};

/// Largest relative difference of the elastic eigenvalues, as many as are listed.
double worst_difference(const Eigen::VectorXd& found, const std::vector<double>& listed) {
    double worst = 0;
    for (std::size_t i = 6; i < listed.size(); ++i)
        worst = std::max(worst, std::abs(found[static_cast<Eigen::Index>(i)] / listed[i] - 1));
    return worst;
}

void expect_rigid(const Eigen::VectorXd& eigenvalues) {
    const double largest = eigenvalues[eigenvalues.size() - 1];
    EXPECT_LT(eigenvalues.head<6>().cwiseAbs().maxCoeff(), 1e-12 * largest);
}

TEST(VibrationModes, AllEigenvaluesOfOneElementMatchTheReferenceTo1em9) {
    const nlohmann::json listed = reference();
    for (const ReferenceBox& b : kReferenceBoxes) {
        const FreeVibrationModes modes = free_vibration_modes(box(b.size, 1, -1));
        ASSERT_EQ(modes.eigenvalues.size(), 81);
        EXPECT_LT(worst_difference(modes.eigenvalues, listed[b.name]["eigenvalues"]), 1e-9) << b.name;
        expect_rigid(modes.eigenvalues);
    }
}

TEST(VibrationModes, EigenvaluesOf2And4And6ElementsASideMatchTheReferenceTo1em9) {
    const nlohmann::json listed = reference();
    for (const ReferenceBox& b : kReferenceBoxes)
        for (const int k : {2, 4, 6}) {
            const FreeVibrationModes modes = free_vibration_modes(box(b.size, k, 18));
            const std::string mesh =
                "mesh_" + std::to_string(k) + "x" + std::to_string(k) + "x" + std::to_string(k);
            ASSERT_GE(modes.eigenvalues.size(), 24);
            EXPECT_LT(worst_difference(modes.eigenvalues, listed[b.name][mesh]), 1e-9) << b.name << mesh;
            expect_rigid(modes.eigenvalues);
        }
}

TEST(VibrationModes, OneElementOfACubeHas12GTwiceAnd24GSixTimesExactly) {
    const Material rubber{3e6, 0.4, 1100};
    const double g = 3e6 / 2.8, unit = g / (1100 * 0.2 * 0.2);
    const Eigen::VectorXd values =
        free_vibration_modes(box(Vector3d::Constant(0.2), 1, 75, rubber)).eigenvalues / unit;
    int of12 = 0, of24 = 0;
    for (const double v : values) {
        of12 += std::abs(v - 12) < 1e-10;
        of24 += std::abs(v - 24) < 1e-10;
    }
    EXPECT_EQ(of12, 2);
    EXPECT_EQ(of24, 6);
}

/// p of the error h^p, of two meshes.
double observed_order(double coarse_error, double fine_error, double refinement) {
    return std::log(coarse_error / fine_error) / std::log(refinement);
}

// Quadratic elements: eigenvalues converge at h^4 where the mode is smooth. Lame modes are: products of a
// sine and a cosine with 2 pi^2 G / (rho L^2), whatever Poisson's ratio. There are three, one a plane; meshes
// split them 2 + 1.
TEST(VibrationModes, LameModesOfTheCubeConvergeToTheirClosedFormAtOrder4) {
    const double exact = 2 * M_PI * M_PI / 2.6;
    Eigen::Array3d coarse = Eigen::Array3d::Zero();
    for (const int k : {2, 4, 8}) {
        const FreeVibrationModes modes = free_vibration_modes(box({1, 1, 1}, k, 18));
        const Eigen::Array3d error = modes.eigenvalues.segment<3>(6 + 8).array() / exact - 1;
        EXPECT_GT(error.minCoeff(), 0) << "Rayleigh-Ritz approaches from above";
        // The third is at 3.79 from 2 to 4 and 3.9 from 4 to 8: higher terms fade.
        for (int i = 0; k > 2 && i < 3; ++i)
            EXPECT_NEAR(observed_order(coarse[i], error[i], 2), 4, k == 4 ? 0.25 : 0.15) << k << ' ' << i;
        coarse = error;
    }
    EXPECT_LT(coarse.maxCoeff(), 2e-4);
}

/// Place of the eigenvalue of the coarse mesh that is of the same class, and the same in order within it, as
/// number i of the fine one: by size alone, close ones swap places.
Eigen::Index counterpart(const FreeVibrationModes& coarse, const FreeVibrationModes& fine, Eigen::Index i) {
    int ahead = 0;
    for (Eigen::Index j = 6; j < i; ++j) ahead += fine.parity[j] == fine.parity[i];
    for (Eigen::Index j = 6; j < coarse.eigenvalues.size(); ++j)
        if (coarse.parity[j] == fine.parity[i] && ahead-- == 0) return j;
    throw std::logic_error("the coarse mesh has too few modes of this class");
}

// Other modes are a little less smooth at the edges and corners, so the order is somewhat below 4.
TEST(VibrationModes, TwelveLowestModesConvergeFromAboveAtOrders3p3To4OnTheMean3p8) {
    const nlohmann::json listed = reference();
    for (const ReferenceBox& b : kReferenceBoxes) {
        const std::vector<double> exact = listed[b.name]["converged_eigenvalues_first30"];
        const FreeVibrationModes coarse = free_vibration_modes(box(b.size, 4, 18)),
                                 fine = free_vibration_modes(box(b.size, 8, 18));
        double sum = 0;
        for (Eigen::Index i = 6; i < 18; ++i) {
            const double before = coarse.eigenvalues[counterpart(coarse, fine, i)] / exact[i] - 1,
                         after = fine.eigenvalues[i] / exact[i] - 1, order = observed_order(before, after, 2);
            EXPECT_GT(after, 0) << b.name << ' ' << i;
            EXPECT_GT(order, 3.3) << b.name << ' ' << i;
            EXPECT_LT(order, 4.1) << b.name << ' ' << i;
            sum += order;
        }
        RecordProperty(b.name, std::to_string(sum / 12));
        EXPECT_NEAR(sum / 12, 3.8, 0.1) << b.name;
    }
}

// Against the converged values: the estimate is 0.85 to 1.01 of the true error for the twenty lowest modes.
TEST(DiscretisationErrors, AreWithinAFifthOfTheTrueOnesFor1To4ElementsASide) {
    const nlohmann::json listed = reference();
    for (const ReferenceBox& b : kReferenceBoxes) {
        const std::vector<double> exact = listed[b.name]["converged_eigenvalues_first30"];
        const FreeVibrationModes fine = free_vibration_modes(box(b.size, 8, 30));
        for (const int k : {1, 2, 3, 4}) {
            const ModesRequest request = box(b.size, k, k == 1 ? 75 : 40);
            const FreeVibrationModes modes = free_vibration_modes(request);
            const Eigen::VectorXd errors = discretisation_errors(request, modes);
            ASSERT_EQ(errors.size(), modes.basis.count());
            EXPECT_TRUE(errors.allFinite());
            for (Eigen::Index i = 6; i < 26; ++i) {
                const Eigen::Index place = counterpart(modes, fine, i);
                const double eigenvalue = modes.eigenvalues[place];
                const double truth = std::sqrt(eigenvalue / exact[static_cast<std::size_t>(i)]) - 1;
                EXPECT_NEAR(errors[place - 6] / truth, 0.95, 0.15) << b.name << " k " << k << " mode " << i;
            }
        }
    }
}

// Lamb 1882: the torsional modes of degree 2 of a sphere, (l - 1) j_l(eta) = eta j_{l+1}(eta), eta = omega R
// sqrt(rho / G). Five of them; meshes split them 2 + 3.
TEST(VibrationModes, SphereConvergesToLambsTorsionalFrequency) {
    double eta = 2.5;
    for (int i = 0; i < 60; ++i) {
        const auto f = [](double x) { return std::sph_bessel(2, x) - x * std::sph_bessel(3, x); };
        eta -= f(eta) / ((f(eta + 1e-6) - f(eta - 1e-6)) / 2e-6);
    }
    const double exact = eta * eta / 2.6 / 0.25;  // R = 1/2
    double coarse = 0;
    for (const int k : {1, 2, 4, 8}) {
        const FreeVibrationModes modes =
            free_vibration_modes({{Vector3d::Constant(0.5), 1, 1}, ModeDomain::superquadric, kUnit, k, 20});
        const Eigen::ArrayXd error = modes.eigenvalues.segment<5>(6).array() / exact - 1;
        EXPECT_GT(error.minCoeff(), 0);
        expect_rigid(modes.eigenvalues);
        EXPECT_LT(error.maxCoeff(), k == 1 ? 0.2 : 0.5 * coarse) << k;
        coarse = error.maxCoeff();
    }
    EXPECT_LT(coarse, 3e-4);
}

TEST(VibrationModes, RigidModesAreZeroTo1em12OfTheLargestForFlatLongAndRoundBodies) {
    for (const Vector3d& axes : {Vector3d(1, 1, 1), Vector3d(1, 0.02, 0.5), Vector3d(0.01, 1, 0.03)})
        for (const double e : {0.1, 1.0, 1.9})
            for (const int k : {1, 2, 4}) {
                const FreeVibrationModes modes =
                    free_vibration_modes({{axes, e, e}, ModeDomain::superquadric, {2e9, 0.3, 900}, k, 20});
                expect_rigid(modes.eigenvalues);
                EXPECT_LT(modes.eigenvalues.head<6>().cwiseAbs().maxCoeff(), 1e-6 * modes.eigenvalues[6]);
            }
}

/// A point of a body with the mass that it stands for.
struct MassPoint {
    Vector3d r;
    double mass;
};

/// Three Gauss points an axis in each of k^3 boxes: exact for products of quadratics.
std::vector<MassPoint> box_points(const Vector3d& half, int k, double density) {
    const double at[] = {-std::sqrt(0.6), 0, std::sqrt(0.6)}, weight[] = {5 / 18.0, 8 / 18.0, 5 / 18.0};
    std::vector<MassPoint> points;
    for (int i = 0; i < 27 * k * k * k; ++i) {
        const int g = i % 27, c = i / 27;
        const Vector3d cell(c % k, c / k % k, c / k / k), local(at[g % 3], at[g / 3 % 3], at[g / 9]);
        const Vector3d unit = (2 * cell + Vector3d::Ones() + local) / k - Vector3d::Ones();
        points.push_back({unit.cwiseProduct(half), density * 8 * half.prod() / (k * k * k) * weight[g % 3] *
                                                       weight[g / 3 % 3] * weight[g / 9]});
    }
    return points;
}

/// Mass and stiffness between modes, integrated by the points alone.
struct Products {
    Eigen::MatrixXd mass, stiffness;
};

Products products(const ModalBasis& basis, const std::vector<MassPoint>& points, const Material& m) {
    const Eigen::Index n = basis.count();
    const double mu = m.young_pa / (2 * (1 + m.poisson)), lambda = 2 * mu * m.poisson / (1 - 2 * m.poisson);
    Products result{Eigen::MatrixXd::Zero(n, n), Eigen::MatrixXd::Zero(n, n)};
    Eigen::MatrixXd strain(6, n);
    for (const MassPoint& p : points) {
        for (Eigen::Index k = 0; k < n; ++k) {
            const Eigen::Matrix3d g = displacement_at(basis, basis.nodal.col(k), p.r).gradient;
            const double shear = std::sqrt(0.5);
            strain.col(k) << g(0, 0), g(1, 1), g(2, 2), shear * (g(1, 2) + g(2, 1)),
                shear * (g(0, 2) + g(2, 0)), shear * (g(0, 1) + g(1, 0));
        }
        const Eigen::Matrix3Xd phi = mode_shapes_at(basis, p.r);
        const Eigen::RowVectorXd trace = strain.topRows<3>().colwise().sum();
        const double volume = p.mass / m.density_kg_m3;
        result.mass += p.mass * phi.transpose() * phi;
        result.stiffness +=
            volume * (lambda * trace.transpose() * trace + 2 * mu * strain.transpose() * strain);
    }
    return result;
}

void expect_orthonormal(const ModalBasis& basis, const Products& p) {
    const Eigen::MatrixXd k =
        basis.omega.cwiseInverse().asDiagonal() * p.stiffness * basis.omega.cwiseInverse().asDiagonal();
    const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(basis.count(), basis.count());
    // Rounding, grown by the ratio of the frequencies (up to 30).
    EXPECT_LT((p.mass - one).cwiseAbs().maxCoeff(), 1e-11);
    EXPECT_LT((k - one).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(VibrationModes, AreOrthonormalInMassAndDiagonaliseTheStiffness) {
    const Material m{2e6, 0.35, 900};
    for (const int k : {1, 2, 4, 5}) {
        const Vector3d size(0.3, 0.2, 0.5);
        const ModalBasis basis = free_vibration_modes(box(size, k, k == 1 ? 75 : 40, m)).basis;
        expect_orthonormal(basis, products(basis, box_points(size / 2, k, 900), m));
    }
}

// Points of an ellipsoid: Gauss along the radius and the height, equal angles: exact for the products of one
// element's polynomials, and of another making than the rule under test.
std::vector<MassPoint> ellipsoid_points(const Vector3d& axes, double density) {
    const double at[] = {0.1488743389816312, 0.4333953941292472, 0.6794095682990244, 0.8650633666889845,
                         0.9739065285171717};
    const double weight[] = {0.2955242247147529, 0.2692667193099963, 0.2190863625159821, 0.1494513491505806,
                             0.0666713443086881};
    std::vector<MassPoint> points;
    for (int i = 0; i < 10 * 10 * 16; ++i) {
        const int a = i % 10, b = i / 10 % 10, c = i / 100;
        const double radius = 0.5 + 0.5 * (a % 2 ? at[a / 2] : -at[a / 2]),
                     z = b % 2 ? at[b / 2] : -at[b / 2];
        const double flat = std::sqrt(1 - z * z), angle = 2 * M_PI * (c + 0.5) / 16;
        const Vector3d unit(flat * std::cos(angle), flat * std::sin(angle), z);
        points.push_back(
            {(radius * unit).cwiseProduct(axes),
             density * axes.prod() * radius * radius / 2 * weight[a / 2] * weight[b / 2] * 2 * M_PI / 16});
    }
    return points;
}

TEST(VibrationModes, OfAnEllipsoidAreOrthonormalOverItsOwnVolume) {
    const Material m{2e6, 0.35, 900};
    const Vector3d axes(0.3, 0.2, 0.5);
    const ModalBasis basis = free_vibration_modes({{axes, 1, 1}, ModeDomain::superquadric, m, 1, 75}).basis;
    expect_orthonormal(basis, products(basis, ellipsoid_points(axes, 900), m));
}

TEST(VibrationModes, TwelveOnACubeCutATripletBetween11And14) {
    for (const int k : {1, 2, 4}) {
        const GroupCut cut = free_vibration_modes(box({1, 1, 1}, k, 12)).cut;
        EXPECT_EQ(cut.count, 12);
        EXPECT_EQ(cut.below, 11);
        EXPECT_EQ(cut.above, 14) << k;
        const GroupCut whole = free_vibration_modes(box({1, 1, 1}, k, 11)).cut;
        EXPECT_EQ(whole.below, 11);
        EXPECT_EQ(whole.above, 11);
    }
}

/// Nodal values of a body whose axis i is axis `from[i]` of the given one.
Eigen::VectorXd permuted(const Eigen::VectorXd& nodal, int elements, const std::array<int, 3>& from) {
    const int m = 2 * elements + 1;
    Eigen::VectorXd result(nodal.size());
    for (int node = 0; node < m * m * m; ++node) {
        const std::array<int, 3> at = {node % m, node / m % m, node / m / m};
        std::array<int, 3> old{};
        for (int i = 0; i < 3; ++i) old[from[i]] = at[i];
        for (int i = 0; i < 3; ++i)
            result[3 * node + i] = nodal[3 * (old[0] + m * (old[1] + m * old[2])) + from[i]];
    }
    return result;
}

// Whole groups of the two: each mode of one is a mode of the other with the same frequency, but for its sign
// (the largest entry's, and which is first depends on the axes' names) and its place within the group
// (classes are in the order of the axes).
TEST(VibrationModes, OfBoxesWithPermutedAxesAreThePermutedModes) {
    const std::array<int, 3> from = {1, 2, 0};
    for (const Vector3d& size : {Vector3d(1, 2, 3), Vector3d(1, 1, 2)})
        for (const int k : {1, 2, 4}) {
            const Vector3d turned(size[from[0]], size[from[1]], size[from[2]]);
            const ModalBasis a = free_vibration_modes(box(size, k, 20)).basis,
                             b = free_vibration_modes(box(turned, k, 20)).basis;
            for (int i = 0; i < 18; ++i) {
                const Eigen::VectorXd mode = permuted(a.nodal.col(i), k, from);
                EXPECT_NEAR(a.omega[i] / b.omega[i], 1, 1e-10);
                double best = 1e9;
                for (int j = std::max(0, i - 3); j < std::min(20, i + 4); ++j)
                    best = std::min({best, (mode - b.nodal.col(j)).norm(), (mode + b.nodal.col(j)).norm()});
                // Two solutions that differ by 1e-3 of their eigenvalue mix by rounding over 1e-3.
                EXPECT_LT(best, 1e-7 * mode.norm()) << size.transpose() << " k " << k << " mode " << i;
            }
        }
}

// Pairs within one class have no axes of their own: without the canonical basis any turn of them would do,
// and the last digits of the input would choose it.
TEST(VibrationModes, DegenerateModesOfACubeDoNotTurnWhenPoissonsRatioChangesInItsLastDigits) {
    for (const int k : {1, 2, 4}) {
        const ModalBasis a = free_vibration_modes(box({1, 1, 1}, k, 18, {1, 0.3, 1})).basis,
                         b = free_vibration_modes(box({1, 1, 1}, k, 18, {1, 0.3 + 1e-12, 1})).basis;
        EXPECT_LT((a.nodal - b.nodal).norm(), 1e-7 * a.nodal.norm()) << k;
        // The first is the response to a push along x at a corner: twice as much along x as along y and z.
        const Eigen::Vector3d corner = a.nodal.col(0).head<3>();
        EXPECT_NEAR(corner.y() / corner.x(), -0.5, 1e-9);
        EXPECT_NEAR(corner.z() / corner.x(), -0.5, 1e-9);
        EXPECT_NEAR(a.nodal.col(1)[0] / corner.x(), 0, 1e-9);
    }
}

TEST(VibrationModes, GroupsAreInTheOrderOfParityClassesAndTheLargestEntryIsPositive) {
    const FreeVibrationModes modes = free_vibration_modes(box({1, 1, 1}, 1, 75));
    for (int i = 0; i < 75; ++i) {
        EXPECT_GT(modes.basis.nodal.col(i).maxCoeff(), 0.999 * -modes.basis.nodal.col(i).minCoeff());
        if (i == 0) continue;
        EXPECT_LE(modes.basis.omega[i - 1], modes.basis.omega[i]);
        const bool equal = modes.basis.omega[i] < modes.basis.omega[i - 1] * (1 + 1e-9);
        EXPECT_TRUE(!equal || modes.parity[6 + i - 1] <= modes.parity[6 + i]);
    }
}

TEST(VibrationModes, RequestsOutOfRangeAreRefused) {
    const auto refuses = [](const ModesRequest& request) {
        EXPECT_THROW((void)free_vibration_modes(request), std::invalid_argument);
    };
    refuses(box({0, 1, 1}, 1, 12));
    refuses(box({1, std::nan(""), 1}, 1, 12));
    refuses(box({1, 1, 0.0009}, 1, 12));
    refuses(box({1, 1, 1}, 0, 12));
    refuses(box({1, 1, 1}, 13, 12));
    refuses(box({1, 1, 1}, 1, -2));
    refuses(box({1, 1, 1}, 1, 12, {0, 0.3, 1}));
    refuses(box({1, 1, 1}, 1, 12, {1, 0.5, 1}));
    refuses(box({1, 1, 1}, 1, 12, {1, -1, 1}));
    refuses(box({1, 1, 1}, 1, 12, {1, 0.3, -1}));
}

}  // namespace
}  // namespace sim
