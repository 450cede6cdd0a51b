#include "sim/superquadric_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sim/surface_mesh.h"

namespace {

std::vector<Eigen::Vector3d> surface_of(const sim::Superquadric& shape, const Eigen::Vector3d& centre) {
    std::vector<Eigen::Vector3d> points;
    for (const Eigen::Vector3d& vertex : sim::surface_mesh({shape, {}}, 2000).vertices)
        points.push_back(vertex + centre);
    return points;
}

/// Points of a superquadric give it back: nothing but the search's own tolerance is between them.
TEST(SuperquadricFit, FindsTheShapeThatPointsWereTakenFrom) {
    const Eigen::Vector3d centre(0.2, -0.1, 0.05);
    for (const sim::Superquadric& shape :
         {sim::Superquadric{{0.18, 0.07, 0.18}, 0.1, 1}, sim::Superquadric{{0.2, 0.012, 0.2}, 0.8, 1},
          sim::Superquadric{{0.3, 0.02, 0.05}, 0.2, 0.3}, sim::Superquadric{{0.08, 0.09, 0.1}, 1, 1},
          sim::Superquadric{{0.1, 0.2, 0.1}, 1.6, 1.2}}) {
        const sim::SuperquadricFit fit = sim::fit_superquadric(surface_of(shape, centre));
        const double size = 2 * shape.semi_axes.maxCoeff();
        EXPECT_LT(fit.error.rms_m, 0.005 * size) << shape.semi_axes.transpose() << " " << shape.e1;
        EXPECT_LT(fit.error.greatest_m, 0.02 * size) << shape.semi_axes.transpose();
        EXPECT_LT((fit.centre - centre).norm(), 0.01 * size);
        EXPECT_LT((fit.shape.semi_axes - shape.semi_axes).norm(), 0.02 * size)
            << fit.shape.semi_axes.transpose();
        EXPECT_NEAR(fit.shape.e1, shape.e1, 0.12);
        EXPECT_NEAR(fit.shape.e2, shape.e2, 0.12);
    }
}

/// Of a dome without a floor, the body that closes it hardly reaches below the rim.
TEST(SuperquadricFit, AnOpenSideIsClosedByTheSmallestBodyThatFits) {
    std::vector<Eigen::Vector3d> dome;
    for (const Eigen::Vector3d& point : surface_of({{0.1, 0.1, 0.1}, 1, 1}, {0, 0, 0}))
        if (point.y() >= 0) dome.push_back(point);
    const sim::SuperquadricFit fit = sim::fit_superquadric(dome);
    EXPECT_LT(fit.error.rms_m, 0.005);
    EXPECT_LE(fit.shape.semi_axes.prod(), 1.01 * 0.001) << "no larger than the whole ball";
}

/// Moved along one axis by d, the sides that it points to lie d away, those along it none.
TEST(SuperquadricFit, TheErrorIsTheDistanceOfThePoints) {
    const sim::Superquadric ball{{0.1, 0.1, 0.1}, 1, 1};
    std::vector<Eigen::Vector3d> larger;
    for (const Eigen::Vector3d& point : surface_of({{0.11, 0.11, 0.11}, 1, 1}, {0, 0, 0}))
        larger.push_back(point);
    const sim::SurfaceError error = sim::surface_error(ball, {0, 0, 0}, larger);
    EXPECT_NEAR(error.rms_m, 0.01, 1e-9);
    EXPECT_NEAR(error.greatest_m, 0.01, 1e-9);
    const sim::SurfaceError moved = sim::surface_error(ball, {0.02, 0, 0}, surface_of(ball, {0, 0, 0}));
    EXPECT_NEAR(moved.greatest_m, 0.02, 1e-4);  // the vertices are not right on the axis
    EXPECT_NEAR(std::abs(moved.farthest.x()), 0.1, 1e-3);
}

TEST(SuperquadricFit, PointsInAPlaneAreNoBody) {
    std::vector<Eigen::Vector3d> flat;
    for (int i = 0; i < 100; ++i) flat.emplace_back(std::cos(i), 0, std::sin(i));
    EXPECT_THROW((void)sim::fit_superquadric(flat), std::invalid_argument);
    EXPECT_THROW((void)sim::fit_superquadric(std::vector<Eigen::Vector3d>(3)), std::invalid_argument);
}

}  // namespace
