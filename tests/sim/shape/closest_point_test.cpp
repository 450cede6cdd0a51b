#include "shape/closest_point.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace {

using Eigen::Vector3d;

double dual_pair(double u, double w, double p) {
    const double q = p / (p - 1), large = std::max(u, w);
    if (large == 0) return 0;
    return large * std::pow(std::pow(u / large, q) + std::pow(w / large, q), 1 / q);
}

// Support function max n.y over the deformed body, in closed form (dual norm): independent of the solver's
// gauge and steps.
double support(const sim::Superquadric& s, const Eigen::Matrix3d& d, const Vector3d& n) {
    const Vector3d m = (d.transpose() * n).cwiseAbs().cwiseProduct(s.semi_axes);
    return dual_pair(dual_pair(m.x(), m.z(), 2 / s.e2), m.y(), 2 / s.e1);
}

sim::Deformation random_deformation(std::mt19937& rng, double size) {
    std::uniform_real_distribution<double> strain(-size, size);
    sim::Deformation d;
    for (int i = 0; i < 3; ++i) {
        d.matrix(i, i) += strain(rng);
        for (int j = 0; j < i; ++j) d.matrix(i, j) = d.matrix(j, i) = strain(rng);
    }
    d.inverse = d.matrix.inverse();
    return d;
}

Vector3d random_direction(std::mt19937& rng) {
    std::normal_distribution<double> normal;
    return Vector3d(normal(rng), normal(rng), normal(rng)).normalized();
}

// Signed distance of a convex body: the largest n.x - h(n) over unit n. Dense directions, then a shrinking
// pattern search.
double brute_distance(const sim::Superquadric& s, const Eigen::Matrix3d& d, const Vector3d& x,
                      const std::vector<Vector3d>& directions) {
    std::vector<std::pair<double, Vector3d>> found;
    const auto gap = [&](const Vector3d& n) { return n.dot(x) - support(s, d, n); };
    for (const Vector3d& n : directions) found.emplace_back(gap(n), n);
    std::partial_sort(found.begin(), found.begin() + 12, found.end(),
                      [](const auto& a, const auto& b) { return a.first > b.first; });
    for (int axis = 0; axis < 3; ++axis) {  // faces' normals, where h has a kink when e is small
        for (const double sign : {-1.0, 1.0}) {
            const Vector3d n = sign * d.inverse().transpose().col(axis).normalized();
            found.insert(found.begin(), {gap(n), n});
        }
    }
    double best = -1e9;
    for (int k = 0; k < 18; ++k) {
        auto [value, n] = found[k];
        int moves = 0;
        for (double step = 0.02; step > 1e-8 && moves < 300; ++moves) {
            bool moved = false;
            const Vector3d t = n.unitOrthogonal(), b = n.cross(t);
            for (int i = 0; i < 8; ++i) {
                const double angle = i * M_PI / 4;
                const Vector3d candidate =
                    (n + step * (std::cos(angle) * t + std::sin(angle) * b)).normalized();
                if (gap(candidate) > value) value = gap(candidate), n = candidate, moved = true;
            }
            if (!moved) step *= 0.5;
        }
        best = std::max(best, value);
    }
    return best;
}

const std::vector<sim::Superquadric> kShapes = {
    {{0.18, 0.10, 0.18}, 0.1, 1.0}, {{0.25, 0.02, 0.25}, 0.1, 1.0}, {{0.1, 0.12, 0.1}, 1.0, 1.0},
    {{0.2, 0.006, 0.2}, 1.0, 1.0},  {{0.3, 0.0025, 0.0025}, 1, 1},  {{0.3, 0.0025, 0.0025}, 0.1, 0.1},
    {{0.2, 0.1, 0.15}, 0.1, 0.1},   {{0.15, 0.1, 0.15}, 0.5, 0.7},  {{0.15, 0.1, 0.12}, 1.5, 1.0},
    {{0.15, 0.1, 0.15}, 1.9, 1.9},  {{0.15, 0.1, 0.15}, 0.1, 1.9},  {{0.15, 0.1, 0.15}, 1.9, 0.1},
};

TEST(ClosestPoint, OutsideDistanceAndItsCertificateAgreeToTenNanometresAndAtKinksToATenthOfAMillimetre) {
    std::mt19937 rng(1);
    for (const sim::Superquadric& shape : kShapes) {
        const sim::Gauge gauge(shape);
        double worst = 0;
        for (int i = 0; i < 3000; ++i) {
            const sim::Deformation d = random_deformation(rng, i % 3 ? 0.12 : 0);
            const Vector3d surface =
                d.matrix * gauge.onto_surface(random_direction(rng).cwiseProduct(shape.semi_axes));
            const Vector3d x =
                surface + std::uniform_real_distribution<double>(0, 0.1)(rng) * surface.normalized();
            const sim::ClosestPoint p = sim::closest_point(gauge, d, x);
            // Weak duality: |x - y| bounds the distance from above, n.x - h(n) from below, whatever y and n
            // are.
            worst = std::max(worst, p.distance - (p.normal.dot(x) - support(shape, d.matrix, p.normal)));
        }
        // Kinks (exponents above 1) converge linearly; a tenth of a millimetre is what contacts need.
        EXPECT_LT(worst, gauge.has_kinks() ? 1e-4 : 1e-8) << shape.e1 << ' ' << shape.e2;
    }
}

TEST(ClosestPoint, UpToTenMillimetresInsideWithinATenthOfAMillimetreOfBruteForce) {
    std::mt19937 rng(2);
    std::vector<Vector3d> directions;
    for (int i = 0; i < 4000; ++i) directions.push_back(random_direction(rng));
    for (const sim::Superquadric& shape : kShapes) {
        const sim::Gauge gauge(shape);
        double worst = 0;
        for (int i = 0; i < 60; ++i) {
            const sim::Deformation d = random_deformation(rng, i % 3 ? 0.1 : 0);
            const Vector3d surface =
                d.matrix * gauge.onto_surface(random_direction(rng).cwiseProduct(shape.semi_axes));
            const double depth = std::uniform_real_distribution<double>(0, 0.012)(rng);
            const Vector3d x = surface * std::max(0.0, 1 - depth / surface.norm());
            const double brute = brute_distance(shape, d.matrix, x, directions);
            const double error = std::abs(sim::closest_point(gauge, d, x).distance - brute);
            if (brute > -0.01) worst = std::max(worst, error);
        }
        EXPECT_LT(worst, 1e-4) << shape.e1 << ' ' << shape.e2;
    }
}

TEST(ClosestPoint, NeverNanOnAxesPolesPlanesAndTheCentre) {
    for (const sim::Superquadric& shape : kShapes) {
        const sim::Gauge gauge(shape);
        for (int i = 0; i < 125; ++i) {
            const double at[] = {0, 1, -1, 0.5, 2};
            const Vector3d x = Vector3d(at[i % 5], at[i / 5 % 5], at[i / 25]).cwiseProduct(shape.semi_axes);
            const sim::ClosestPoint p = sim::closest_point(gauge, {}, x);
            ASSERT_TRUE(std::isfinite(p.distance) && p.normal.allFinite() && p.point.allFinite())
                << x.transpose();
            ASSERT_NEAR(p.normal.norm(), 1, 1e-12);
        }
    }
}

TEST(ClosestPoint, SphereAndDeformedSphereMatchTheirClosedForms) {
    const sim::Gauge gauge({Vector3d::Constant(0.1), 1, 1});
    std::mt19937 rng(3);
    for (int i = 0; i < 200; ++i) {
        const Vector3d x = random_direction(rng) * std::uniform_real_distribution<double>(0.01, 0.3)(rng);
        const sim::ClosestPoint p = sim::closest_point(gauge, {}, x);
        EXPECT_NEAR(p.distance, x.norm() - 0.1, 1e-12);
        EXPECT_LT((p.normal - x.normalized()).norm(),
                  1e-6);  // derivatives are linear within 1e-7 of a coordinate plane
    }
}

TEST(ClosestPoint, DrumHeadIsFlatToATenthOfAMillimetreOverItsInnerHalf) {
    const sim::Gauge gauge({{0.18, 0.1, 0.18}, 0.1, 1});
    // (1 - 0.6^20)^(1/20) differs from 1 by 1.8e-6
    for (double x = 0; x < 0.6 * 0.18; x += 0.003) {
        const sim::ClosestPoint p = sim::closest_point(gauge, {}, Vector3d(x, 0.12, 0));
        EXPECT_NEAR(p.distance, 0.02, 1e-6);
    }
}

}  // namespace
