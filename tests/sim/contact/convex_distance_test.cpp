#include "contact/convex_distance.h"

#include <gtest/gtest.h>

#include <random>

#include "world_bodies.h"

using Eigen::Vector3d;

namespace sim {
namespace {

Vector3d any_direction(std::mt19937& random) {
    auto u = [&random] { return random() / 2147483647.5 - 1; };
    Vector3d v;
    do v = {u(), u(), u()};
    while (v.norm() > 1 || v.norm() < 0.1);
    return v.normalized();
}

TEST(GaugeSupport, IsOnTheSurfaceAndFurthestOfAll) {
    std::mt19937 random(1);
    for (const double e1 : {0.1, 0.6, 1.0, 1.5, 1.9})
        for (const double e2 : {0.1, 1.0, 1.9}) {
            const Gauge gauge({{0.3, 0.05, 0.7}, e1, e2});
            for (int i = 0; i < 50; ++i) {
                const Vector3d d = any_direction(random), p = gauge.support(d);
                EXPECT_NEAR(gauge.value(p), 1, 1e-9);
                for (int k = 0; k < 50; ++k)
                    EXPECT_LE(gauge.onto_surface(any_direction(random)).dot(d), p.dot(d) + 1e-12);
            }
        }
}

struct PosedHull {
    BodyKind kind;
    PosedBody body;
    explicit PosedHull(const WorldBody& definition) : kind(make_body_kind(definition, {})) {
        body.kind = &kind;
        body.set(definition.world_from_body.translation(),
                 Eigen::Quaterniond(definition.world_from_body.rotation()),
                 Eigen::VectorXd::Zero(kind.modes));
    }
};

ConvexDistance distance(const PosedHull& a, const PosedHull& b) {
    const ConvexBody of_a(a.body), of_b(b.body);
    return distance_between({&of_a, a.body.position, a.body.rotation},
                            {&of_b, b.body.position, b.body.rotation}, 1e-9);
}

TEST(ConvexDistance, OfBallsIsExactNearFarAndOverlapping) {
    for (const Fidelity fidelity : {Fidelity::rigid, Fidelity::linear, Fidelity::modal})
        for (const double gap : {-0.05, 0.0, 1e-6, 0.3, 100.0}) {
            const Vector3d way = Vector3d(1, 2, -2) / 3;
            const PosedHull a(world_test::ball((0.7 + gap) * way, fidelity, 0.5)),
                b(world_test::ball({0, 0, 0}, Fidelity::rigid, 0.2));
            const ConvexDistance d = distance(a, b);
            ASSERT_TRUE(d.apart);
            EXPECT_NEAR(d.gap, gap, 1e-6 * (1 + gap));
            EXPECT_LT((d.normal - way).norm(), 1e-4);
        }
}

TEST(ConvexDistance, OfACardBesideABallIsThatToItsEdgeAndNotToThePlaneOfItsFace) {
    const PosedHull card(world_test::box({0, 0, 0}, {0.1, 0.005, 0.1})),
        ball(world_test::ball({0.5, 0.02, 0}, Fidelity::rigid, 0.01));
    const ConvexDistance d = distance(ball, card);
    ASSERT_TRUE(d.apart);
    EXPECT_NEAR(d.gap, 0.39, 0.001);
    EXPECT_GT(d.normal.x(), 0.99);
}

TEST(ConvexDistance, OfEllipsoidsIsTheLeastOverManyDirections) {
    std::mt19937 random(5);
    for (int i = 0; i < 20; ++i) {
        WorldBody p = world_test::ball(2 * any_direction(random)), q = world_test::ball({0, 0, 0});
        p.shape.base.semi_axes = {0.2, 0.4, 0.6}, q.shape.base.semi_axes = {0.7, 0.3, 0.5};
        p.world_from_body.linear() = Eigen::AngleAxisd(i, any_direction(random)).toRotationMatrix();
        const PosedHull a(p), b(q);
        const ConvexDistance d = distance(a, b);
        ASSERT_TRUE(d.apart);
        // A plane parts them by at most the distance, and by all of it along the normal.
        double most = -1e9;
        for (int k = 0; k < 20000; ++k) {
            const Vector3d n = any_direction(random);
            const double reach_a =
                             p.shape.base.semi_axes.cwiseProduct(a.body.rotation.transpose() * n).norm(),
                         reach_b = q.shape.base.semi_axes.cwiseProduct(n).norm();
            most = std::max(most, n.dot(a.body.position) - reach_a - reach_b);
        }
        EXPECT_LE(most, d.gap + 1e-8);
        EXPECT_NEAR(most, d.gap, 0.002);
        EXPECT_LT(((a.body.position + d.arm_a) - d.arm_b - d.gap * d.normal).norm(), 1e-3);
    }
}

}  // namespace
}  // namespace sim
