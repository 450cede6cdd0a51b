#include "shape/generalized_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace {

using Eigen::Vector3d;

const std::vector<double> kExponents = {0.1, 0.6, 1, 1.4, 1.9};
const std::vector<Vector3d> kSemiAxes = {{1, 1, 1},      {1, 0.3, 1},   {1, 0.1, 1}, {0.3, 1, 0.3},
                                         {1, 0.5, 0.25}, {0.1, 0.1, 1}, {1, 1, 0.1}};

double dual_norm(double u, double w, double p) {
    const double q = p / (p - 1), large = std::max(u, w);
    if (large == 0) return 0;
    return large * std::pow(1 + std::pow(std::min(u, w) / large, q), 1 / q);
}

// Largest n . y over the body for n = m / semi-axes, by the dual norm: knows nothing of the gauge's gradient.
double support_by_dual(const sim::Superquadric& s, const Vector3d& m) {
    return dual_norm(dual_norm(m.x(), m.z(), 2 / s.e2), m.y(), 2 / s.e1);
}

// Depth of a point of the positive octant: the least distance from a bearing plane, by brute force over
// directions m, then a shrinking pattern search from the two best that are apart.
class TrueDepth {
public:
    explicit TrueDepth(const sim::Superquadric& shape) : shape_(shape) {
        const int n = 40;
        for (int i = 0; i <= n; ++i) {
            for (int j = 0; j <= n; ++j) {
                const double a = 0.5 * std::numbers::pi * i / n, b = 0.5 * std::numbers::pi * j / n;
                add(Vector3d(std::cos(a) * std::cos(b), std::sin(a), std::cos(a) * std::sin(b)).cwiseMax(0));
            }
        }
    }

    [[nodiscard]] double operator()(const Vector3d& r) const {
        double best = std::numeric_limits<double>::max();
        Vector3d first = Vector3d::Zero();
        for (int start = 0; start < 2; ++start) {
            double least = std::numeric_limits<double>::max();
            Vector3d from = Vector3d::UnitX();
            for (const Plane& plane : planes_) {
                const double gap = plane.offset - plane.normal.dot(r);
                if (gap < least && plane.m.dot(first) < 0.97) least = gap, from = plane.m;
            }
            first = from;
            best = std::min(best, refined(r, from));
        }
        return best;
    }

private:
    struct Plane {
        Vector3d m, normal;
        double offset;
    };

    void add(const Vector3d& m) {
        const Vector3d n = m.cwiseQuotient(shape_.semi_axes);
        planes_.push_back({m, n.normalized(), support_by_dual(shape_, m) / n.norm()});
    }

    [[nodiscard]] double gap(const Vector3d& r, const Vector3d& m) const {
        const Vector3d n = m.cwiseQuotient(shape_.semi_axes);
        return (support_by_dual(shape_, m) - n.dot(r)) / n.norm();
    }

    [[nodiscard]] double refined(const Vector3d& r, Vector3d m) const {
        double best = gap(r, m);
        double step = 0.03;
        for (int moves = 0; step > 1e-5 && moves < 200; ++moves) {
            bool moved = false;
            for (int i = 0; i < 6; ++i) {
                const Vector3d next =
                    (m + (i % 2 ? step : -step) * Vector3d::Unit(i / 2)).cwiseMax(0).normalized();
                const double value = gap(r, next);
                if (value < best) best = value, m = next, moved = true;
            }
            if (!moved) step /= 2;
        }
        return best;
    }

    sim::Superquadric shape_;
    std::vector<Plane> planes_;
};

// Surface points of the positive octant: anywhere, near and on the coordinate planes, the poles, the corner.
std::vector<Vector3d> surface_points(const sim::Gauge& gauge, int count, std::mt19937& random) {
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> power(-5, 0);
    std::vector<Vector3d> points = {Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ(),
                                    Vector3d::Ones()};
    for (int i = 0; i < count; ++i) {
        Vector3d v = Vector3d(normal(random), normal(random), normal(random)).cwiseAbs();
        if (i % 3 == 0) v[i % 9 / 3] *= std::pow(10, power(random));
        if (i % 5 == 0) v[i % 15 / 5] = 0;
        points.push_back(v);
    }
    for (Vector3d& p : points) p = gauge.onto_surface(p.cwiseProduct(gauge.semi_axes()));
    return points;
}

struct WorstDepth {
    double too_deep = 1, too_shallow = 1, shallower_too_deep = 1;
};

// Estimated over true depth of points 5 % of the smallest semi-axis below the surface, and of shallower ones.
WorstDepth worst_depth(const sim::Superquadric& shape, std::mt19937& random) {
    const sim::GeneralizedSurface surface({shape, {}});
    const TrueDepth true_depth(shape);
    const double depth = 0.05 * shape.semi_axes.minCoeff();
    WorstDepth worst;
    for (const Vector3d& p : surface_points(surface.base(), 50, random)) {
        const Vector3d r = (p - depth * surface.base().slope(p).gradient.normalized()).cwiseAbs();
        if (surface.base().value(r) >= 1) continue;
        const double truth = true_depth(r), ratio = -surface.distance(r).distance / truth;
        double& most = truth > 0.9 * depth ? worst.too_deep : worst.shallower_too_deep;
        most = std::max(most, ratio);
        worst.too_shallow = std::min(worst.too_shallow, ratio);
    }
    return worst;
}

TEST(GeneralizedSurface, DepthIsWithin15PercentAtFivePercentDepthForAllExponentsAndAspects) {
    std::mt19937 random(1);
    for (const Vector3d& semi_axes : kSemiAxes) {
        for (const double e1 : kExponents) {
            for (const double e2 : kExponents) {
                const WorstDepth worst = worst_depth({semi_axes, e1, e2}, random);
                const auto where = [&] {
                    return ::testing::Message() << semi_axes.transpose() << ' ' << e1 << ' ' << e2;
                };
                EXPECT_LT(worst.too_deep, std::max(e1, e2) > 1 ? 1.08 : 1.04) << where();
                EXPECT_LT(worst.shallower_too_deep, 1.2) << where();
                // Every bearing plane is too deep, if anything; the reference's search, along h's edges, ends
                // within half a percent.
                EXPECT_GT(worst.too_shallow, 0.995) << where();
            }
        }
    }
}

TEST(GeneralizedSurface, EllipsoidsAreWithinHalfAPercentAtFivePercentDepthAndSpheresExact) {
    std::mt19937 random(2);
    for (const Vector3d& semi_axes : kSemiAxes)
        EXPECT_LT(worst_depth({semi_axes, 1, 1}, random).too_deep, 1.006);
    const sim::GeneralizedSurface sphere({{Vector3d(0.5, 0.5, 0.5), 1, 1}, {}});
    for (const double radius : {0.1, 0.49, 0.5, 0.7, 30.0}) {
        const Vector3d n = Vector3d(1, -2, 3).normalized();
        const sim::SurfacePoint at = sphere.distance(radius * n);
        EXPECT_NEAR(at.distance, radius - 0.5, 1e-14);
        EXPECT_LT((at.normal - n).norm(), 1e-15);
    }
}

TEST(GeneralizedSurface, OutsideTheDistanceIsALowerBoundAndRightToFirstOrder) {
    std::mt19937 random(3);
    for (const Vector3d& semi_axes : kSemiAxes) {
        for (const double e1 : kExponents) {
            const sim::GeneralizedSurface surface({{semi_axes, e1, 1}, {}});
            for (const Vector3d& p : surface_points(surface.base(), 30, random)) {
                const Vector3d n = surface.base().slope(p).gradient.normalized();
                // Out along the normal the true distance is the way gone.
                for (const double way : {1e-2, 1e-5}) {
                    const double gone = way * semi_axes.minCoeff();
                    EXPECT_LT(surface.distance(p + gone * n).distance, gone * (1 + 1e-9));
                    EXPECT_GE(surface.distance(p + gone * n).distance, 0);
                }
                if (p.minCoeff() < 0.02 * p.maxCoeff()) continue;  // kinks are sharper than the step
                // The normal turns by the curvature, at most 1e3 / m here, on a way of 1e-7.
                const double gone = 1e-7 * semi_axes.minCoeff();
                EXPECT_NEAR(surface.distance(p + gone * n).distance / gone, 1, 1e-3)
                    << semi_axes.transpose() << ' ' << e1;
            }
        }
    }
}

TEST(GeneralizedSurface, AxesPolesCentreDenormalsAndFarPointsAreFiniteWithAUnitGradient) {
    const double tiny = std::numeric_limits<double>::denorm_min();
    const std::vector<double> coordinates = {0, -0.0, tiny, -1e-300, 1e-9, 0.3, -1, 1, 1.5, 1e6};
    const std::vector<sim::Bump> bumps = {{Vector3d::UnitY(), 0.2, 0.2}, {Vector3d(-1, 0.5, 0), -0.1, 0.3}};
    for (const double e1 : kExponents) {
        for (const double e2 : kExponents) {
            for (const bool bumpy : {false, true}) {
                const sim::GeneralizedSurface surface(
                    {{Vector3d(1, 0.5, 0.3), e1, e2}, bumpy ? bumps : std::vector<sim::Bump>{}});
                for (const double x : coordinates)
                    for (const double y : coordinates)
                        for (const double z : coordinates) {
                            const sim::SurfacePoint at = surface.distance(Vector3d(x, y, z));
                            ASSERT_TRUE(std::isfinite(at.distance))
                                << e1 << ' ' << e2 << ' ' << x << ' ' << y << ' ' << z;
                            ASSERT_NEAR(at.normal.norm(), 1, 1e-12)
                                << e1 << ' ' << e2 << ' ' << x << ' ' << y << ' ' << z;
                        }
            }
        }
    }
}

TEST(GeneralizedSurface, MirroredPointsHaveMirroredDistances) {
    const sim::GeneralizedSurface surface({{Vector3d(1, 0.5, 0.3), 1.7, 0.3}, {}});
    const sim::SurfacePoint at = surface.distance(Vector3d(0.3, 0.2, 0.05));
    for (const Vector3d& side : {Vector3d(-1, 1, 1), Vector3d(1, -1, 1), Vector3d(-1, -1, -1)}) {
        const sim::SurfacePoint mirrored = surface.distance(Vector3d(0.3, 0.2, 0.05).cwiseProduct(side));
        EXPECT_EQ(mirrored.distance, at.distance);
        EXPECT_EQ(mirrored.normal, at.normal.cwiseProduct(side));
    }
}

// Directions about which a body of six spikes is worth looking at.
std::vector<Vector3d> directions_about(const Vector3d& peak, std::mt19937& random) {
    std::normal_distribution<double> normal(0, 0.15);
    std::vector<Vector3d> directions = {peak};
    for (int i = 0; i < 100; ++i)
        directions.push_back((peak.normalized() + Vector3d(normal(random), normal(random), normal(random))));
    return directions;
}

sim::GeneralizedSuperquadric spiked(const Vector3d& semi_axes, double height) {
    sim::GeneralizedSuperquadric shape{{semi_axes, 1, 1}, {}};
    for (int axis = 0; axis < 3; ++axis)
        for (const double sign : {-1.0, 1.0})
            shape.bumps.push_back({sign * semi_axes[axis] * Vector3d::Unit(axis), height, 0.25});
    return shape;
}

TEST(GeneralizedSurface, TheSurfaceOfASpikedSphereIsWhereItsPointsAreDisplacedAlongTheNormal) {
    std::mt19937 random(4);
    for (const double height : {0.15, -0.1}) {
        const sim::GeneralizedSurface surface(spiked(Vector3d(0.5, 0.5, 0.5), height));
        for (const Vector3d& direction : directions_about(Vector3d(0, -1, 0), random)) {
            const Vector3d on = surface.surface_point(direction);
            EXPECT_NEAR(on.norm(), 0.5 + surface.displacement(direction).value, 1e-14);
            EXPECT_NEAR(surface.distance(on).distance, 0, 1e-12);
        }
    }
}

TEST(GeneralizedSurface, TheSurfaceOfASpikedEllipsoidIsFoundTo2PercentOfTheSpike) {
    std::mt19937 random(5);
    const sim::GeneralizedSurface surface(spiked(Vector3d(0.5, 0.4, 0.6), 0.12));
    for (const Vector3d& peak : {Vector3d(0.5, 0, 0), Vector3d(0, -0.4, 0), Vector3d(0, 0, 0.6)})
        for (const Vector3d& direction : directions_about(peak, random))
            EXPECT_NEAR(surface.distance(surface.surface_point(direction)).distance, 0, 0.02 * 0.12);
}

TEST(GeneralizedSurface, NearASpikesSurfaceTheDistanceIsRightToFirstOrderAndItsGradientIsTheNormal) {
    std::mt19937 random(6);
    const sim::GeneralizedSurface surface(spiked(Vector3d(0.5, 0.5, 0.5), 0.15));
    for (const Vector3d& direction : directions_about(Vector3d(0.5, 0, 0), random)) {
        // The surface's own normal, from neighbours along two tangents.
        const Vector3d t = direction.unitOrthogonal(), b = direction.normalized().cross(t);
        const auto beside = [&](const Vector3d& v) {
            return surface.surface_point(direction.normalized() + 1e-6 * v);
        };
        const Vector3d normal = (beside(t) - beside(-t)).cross(beside(b) - beside(-b)).normalized();
        const Vector3d on = surface.surface_point(direction);
        EXPECT_LT((surface.distance(on).normal - normal).norm(),
                  1e-6);                        // differences of 1e-6, rounded to 1e-10
        for (const double way : {-1e-3, 1e-3})  // curvature about 30 / m there: 3 % of the way
            EXPECT_NEAR(surface.distance(on + way * normal).distance / way, 1, 0.03);
    }
}

TEST(GeneralizedSurface, TheBoundingRadiusHoldsASpikedBodyAndNotTwiceItsSpikes) {
    const sim::GeneralizedSurface surface(spiked(Vector3d(0.5, 0.5, 0.5), 0.15));
    EXPECT_NEAR(surface.bounding_radius(), 0.65, 0.01);  // six spikes 90 degrees apart hardly overlap
    sim::GeneralizedSuperquadric close = spiked(Vector3d(0.5, 0.5, 0.5), 0.15);
    close.bumps.push_back({Vector3d(1, 0.2, 0), 0.1, 0.3});
    close.bumps.push_back({Vector3d(1, -0.2, 0), 0.1, 0.3});
    const sim::GeneralizedSurface crowded(close);
    std::mt19937 random(7);
    for (const Vector3d& direction : directions_about(Vector3d(1, 0, 0), random))
        EXPECT_LE(crowded.surface_point(direction).norm(), crowded.bounding_radius());
}

}  // namespace
