#include "sim/hermite_piece.h"

#include <gtest/gtest.h>

namespace sim {
namespace {

using Eigen::Vector3d;

/// A cubic and its derivative.
Vector3d position(double t) {
    return {1 - 2 * t + 3 * t * t * t, t * t, 4 * t * t * t - t};
}
Vector3d velocity(double t) {
    return {-2 + 9 * t * t, 2 * t, 12 * t * t - 1};
}

TEST(HermitePiece, IsExactForACubicItsVelocityToo) {
    const double t0 = 0.3, t1 = 0.8;
    const HermitePiece piece({t0, position(t0), velocity(t0)}, {t1, position(t1), velocity(t1)});
    EXPECT_EQ(piece.position(t0), position(t0));
    EXPECT_EQ(piece.position(t1), position(t1));
    for (int i = 0; i <= 20; ++i) {
        const double t = t0 + (t1 - t0) * i / 20;
        EXPECT_LT((piece.position(t) - position(t)).norm(), 1e-14) << t;  // rounding of sums of order 3
        EXPECT_LT((piece.velocity(t) - velocity(t)).norm(), 1e-13) << t;
        EXPECT_LE(velocity(t).norm(), piece.greatest_speed()) << t;
    }
}

TEST(HermitePiece, OfAStraightUniformMotionTheGreatestSpeedIsItsSpeed) {
    const Vector3d v(3, 0, 4);
    const HermitePiece piece({1, Vector3d::Zero(), v}, {1.5, 0.5 * v, v});
    EXPECT_NEAR(piece.greatest_speed(), 5, 1e-14);
}

}  // namespace
}  // namespace sim
