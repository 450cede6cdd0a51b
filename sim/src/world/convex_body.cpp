#include "world/convex_body.h"

#include <algorithm>
#include <cmath>

#include "shape/shape_polynomial.h"

namespace sim {
namespace {

constexpr int kModalSteps = 2;
constexpr double kBent = 0.01;  // of the smallest semi-axis

double smallest_axis(const BodyKind& kind) {
    return kind.definition.shape.base.semi_axes.minCoeff();
}

// Of a ball about the centre that the rest shape holds: exponents to 1 hold the ellipsoid, others the
// octahedron of the poles.
double inner_radius(const BodyKind& kind) {
    const Superquadric& base = kind.definition.shape.base;
    if (base.e1 <= 1 && base.e2 <= 1) return base.semi_axes.minCoeff();
    return 1 / base.semi_axes.cwiseInverse().norm();
}

}  // namespace

double turn_reach_of(const BodyKind& kind) noexcept {
    const double outer = kind.surface.bounding_radius(), inner = inner_radius(kind);
    return std::sqrt(std::max(0.0, outer * outer - inner * inner));
}

bool is_bent(const PosedBody& posed) noexcept {
    return posed.kind->modes > 0 && !posed.kind->linear() &&
           posed.sample_reach > static_cast<float>(kBent * smallest_axis(*posed.kind));
}

bool is_round(const PosedBody& posed) noexcept {
    return posed.kind->ellipsoid && !is_bent(posed);
}

ConvexBody::ConvexBody(const PosedBody& posed, double scale) noexcept : posed_(&posed), scale_(scale) {
    const BodyKind& kind = *posed.kind;
    const double bent = static_cast<double>(posed.sample_reach);
    if (kind.ellipsoid) {
        const Eigen::Vector3d& axes = kind.definition.shape.base.semi_axes;
        // A strain e takes at most (1 - e)^2 / (1 + e) from a radius of curvature; modes bend besides.
        const double strain = (kind.linear() ? 1.0 : 4.0) * bent / axes.minCoeff();
        const double left = std::max(0.0, 1 - strain);
        shrunk_ = is_bent(posed)
                      ? 0
                      : axes.minCoeff() * axes.minCoeff() / axes.maxCoeff() * left * left / (1 + strain);
        margin_ = shrunk_;
    }
    margin_ += kind.surface.reach();
    margin_ *= scale;
    const double reach = turn_reach_of(kind);
    // A deformed ball is no ball: sqrt((R + u)^2 - (r - u)^2).
    turn_reach_ = bent > 0 ? std::sqrt(reach * reach + 4 * kind.surface.bounding_radius() * bent) : reach;
}

ConvexBody::Point ConvexBody::support(const Eigen::Vector3d& direction) const noexcept {
    const BodyKind& kind = *posed_->kind;
    Point point;
    if (kind.modes == 0) {
        point.place = point.rest = kind.surface.base().support(direction);
    } else if (kind.linear()) {
        const Eigen::Matrix3d d = posed_->deformation.cast<double>();
        point.rest = kind.surface.base().support(d.transpose() * direction);
        point.place = d * point.rest;
    } else {
        point = modal_support(direction);
    }
    point.place = scale_ * (point.place - shrunk_ * direction);
    return point;
}

ConvexBody::Point ConvexBody::modal_support(const Eigen::Vector3d& direction) const noexcept {
    const BodyKind& kind = *posed_->kind;
    const double bricks = kind.bricks;
    Point best{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    double furthest = -1e300;
    Eigen::Vector3d pulled = direction;
    for (int step = 0; step < kModalSteps; ++step) {
        const Eigen::Vector3d rest = kind.surface.base().support(pulled);
        const BodyKind::Local local = kind.locate(rest.cast<float>());
        const PolynomialValue<float> p = evaluate_polynomial<float>(
            posed_->polynomial.data() + 81 * local.brick, local.xi.x(), local.xi.y(), local.xi.z());
        const Eigen::Vector3d place = rest + Eigen::Vector3d(p.u[0], p.u[1], p.u[2]);
        const double far = place.dot(direction);
        if (far > furthest) furthest = far, best = {place, rest};
        const Eigen::Vector3d before = pulled;
        for (int j = 0; j < 3; ++j) {
            double sum = 0;
            for (int i = 0; i < 3; ++i) sum += static_cast<double>(p.gradient[i][j]) * direction[i];
            pulled[j] = direction[j] + bricks / kind.basis.half_extents[j] * sum;
        }
        if ((pulled - before).squaredNorm() < 1e-8) break;
    }
    return best;
}

}  // namespace sim
