#include "modes/cell_rule.h"

#include <gtest/gtest.h>

#include <cmath>

#include "modes/linear_body.h"
#include "shape/superquadric.h"

namespace sim {
namespace {

using Eigen::Vector3d;

/// Integral of x^a y^b z^c over the octant of the unit superquadric by a rule.
double integral(const OctantRule& rule, int elements, const Eigen::Array3d& power) {
    const OctantAxis axis{elements};
    const int n = axis.cells();
    double sum = 0;
    for (int c = 0; c < n * n * n; ++c) {
        const Vector3d element(axis.element(c % n), axis.element(c / n % n), axis.element(c / n / n));
        const CellRule& cell = rule[static_cast<std::size_t>(c)];
        for (Eigen::Index q = 0; q < cell.weights.size(); ++q) {
            const Eigen::Array3d x =
                ((cell.points.col(q) + Vector3d::Ones() + 2 * element) / elements - Vector3d::Ones()).array();
            sum += cell.weights[q] * x.pow(power).prod();
        }
    }
    return sum;
}

/// The same in closed form (Dirichlet): first the section, which scales with its radius, then along y.
double closed_form(double e1, double e2, const Eigen::Array3d& power) {
    const double p1 = 2 / e1, p2 = 2 / e2, a = power.x() + 1, b = power.y() + 1, c = power.z() + 1;
    const double section = std::beta(a / p2, c / p2) / (p2 * (a + c));
    return section * std::beta(b / p1, (a + c) / p1 + 1) / p1;
}

TEST(CellRule, VolumeAndSecondMomentsOfSuperquadricsMatchLinearBodyTo1em10ForAnyElements) {
    for (const double e1 : {0.1, 0.13, 0.5, 1.0, 1.7, 1.9})
        for (const double e2 : {0.1, 0.3, 1.0, 1.37, 1.9})
            for (const int k : {1, 2, 3, 4, 5}) {
                const Superquadric shape{{1, 1, 1}, e1, e2};
                const OctantRule rule = superquadric_rule(shape, k);
                const VolumeMoments exact = volume_moments(Gauge(shape));
                EXPECT_NEAR(8 * integral(rule, k, {0, 0, 0}) / exact.volume, 1, 1e-10) << e1 << ' ' << e2;
                for (int i = 0; i < 3; ++i)
                    EXPECT_NEAR(8 * integral(rule, k, 2 * Vector3d::Unit(i).array()) / exact.second[i], 1,
                                1e-10)
                        << e1 << ' ' << e2 << ' ' << k;
            }
}

// Mass and stiffness of one element integrate nothing else than these.
TEST(CellRule, AllMomentsToTheFourthPowerMatchTheirClosedFormTo1em10) {
    for (const double e1 : {0.1, 1.0, 1.9})
        for (const double e2 : {0.1, 1.0, 1.9})
            for (const int k : {1, 2, 3}) {
                const OctantRule rule = superquadric_rule({{1, 1, 1}, e1, e2}, k);
                for (int i = 0; i < 125; ++i) {
                    const Eigen::Array3d power(i % 5, i / 5 % 5, i / 25);
                    EXPECT_NEAR(integral(rule, k, power) / closed_form(e1, e2, power), 1, 1e-10)
                        << e1 << ' ' << e2 << ' ' << k << ": " << power.transpose();
                }
            }
}

TEST(CellRule, BoxesAreExactToTheFifthPower) {
    for (const int k : {1, 2, 3, 4}) {
        const OctantRule rule = box_rule(k);
        for (int i = 0; i < 216; ++i) {
            const Eigen::Array3d power(i % 6, i / 6 % 6, i / 36);
            EXPECT_NEAR(integral(rule, k, power) * (power + 1).prod(), 1, 1e-13);
        }
    }
}

}  // namespace
}  // namespace sim
