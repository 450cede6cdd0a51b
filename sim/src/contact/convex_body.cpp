#include "contact/convex_body.h"

#include <algorithm>
#include <cmath>

#include "shape/shape_polynomial.h"

namespace sim {
namespace {

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

double smallest_radius(const BodyKind& kind) noexcept {
    const Eigen::Vector3d& axes = kind.definition.shape.base.semi_axes;
    return axes.minCoeff() * axes.minCoeff() / axes.maxCoeff();
}

bool is_bent(const PosedBody& posed) noexcept {
    return posed.kind->modes > 0 && !posed.kind->linear() &&
           posed.sample_reach > static_cast<float>(kBent * smallest_axis(*posed.kind));
}

bool is_round(const PosedBody& posed) noexcept {
    return posed.kind->ellipsoid && !is_bent(posed);
}

ConvexBody::ConvexBody(const PosedBody& posed, double inside) noexcept
    : posed_(&posed),
      scale_(1 - inside * posed.kind->definition.shape.base.semi_axes.cwiseInverse().array()),
      inside_(inside > 0),
      hull_(posed.kind->modes > 0 && !posed.kind->linear() && !is_round(posed)) {
    const BodyKind& kind = *posed.kind;
    const double bent = static_cast<double>(posed.sample_reach);
    if (kind.ellipsoid && !inside_) {
        const Eigen::Vector3d& axes = kind.definition.shape.base.semi_axes;
        // A strain e takes at most (1 - e)^2 / (1 + e) from a radius of curvature; modes bend besides.
        const double strain = (kind.linear() ? 1.0 : 4.0) * bent / axes.minCoeff();
        const double left = std::max(0.0, 1 - strain);
        shrunk_ = is_bent(posed) ? 0 : smallest_radius(kind) * left * left / (1 + strain);
        margin_ = shrunk_;
    }
    if (!hull_) margin_ += kind.surface.reach();  // samples lie on the bumps
    const double reach = turn_reach_of(kind);
    // A deformed ball is no ball: sqrt((R + u)^2 - (r - u)^2).
    turn_reach_ = bent > 0 ? std::sqrt(reach * reach + 4 * kind.surface.bounding_radius() * bent) : reach;
}

ConvexBody::Point ConvexBody::support(const Eigen::Vector3d& direction) const noexcept {
    if (inside_) {
        const Eigen::Vector3d pulled = scale_ * direction.array();
        Point point = outer_support(pulled / pulled.norm());
        point.place = scale_ * point.place.array();
        return point;
    }
    Point point = outer_support(direction);
    point.place -= shrunk_ * direction;
    return point;
}

ConvexBody::Point ConvexBody::outer_support(const Eigen::Vector3d& direction) const noexcept {
    const BodyKind& kind = *posed_->kind;
    Point point;
    if (kind.modes == 0) {
        point.place = point.rest = kind.surface.base().support(direction);
    } else if (kind.linear()) {
        const Eigen::Matrix3d d = posed_->deformation.cast<double>();
        point.rest = kind.surface.base().support(d.transpose() * direction);
        point.place = d * point.rest;
    } else {
        point = hull_ ? sample_support(direction) : round_support(direction);
    }
    return point;
}

// Of a body that modes bend so little that r + u(r) is furthest where F^T d points, to second order.
ConvexBody::Point ConvexBody::round_support(const Eigen::Vector3d& direction) const noexcept {
    const BodyKind& kind = *posed_->kind;
    const Eigen::Vector3d near = kind.surface.base().support(direction);
    const BodyKind::Local local = kind.locate(near.cast<float>());
    const PolynomialValue<float> p = evaluate_polynomial<float>(posed_->polynomial.data() + 81 * local.brick,
                                                                local.xi.x(), local.xi.y(), local.xi.z());
    Eigen::Matrix3d bend;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            bend(i, j) = static_cast<double>(p.gradient[i][j]) * kind.bricks / kind.basis.half_extents[j];
    const Eigen::Vector3d rest = kind.surface.base().support(direction + bend.transpose() * direction);
    return {rest + Eigen::Vector3d(p.u[0], p.u[1], p.u[2]) + bend * (rest - near), rest};
}

// Of the hull of the samples.
ConvexBody::Point ConvexBody::sample_support(const Eigen::Vector3d& direction) const noexcept {
    const int at = posed_->furthest_sample(direction.cast<float>()).first;
    const float* rest = posed_->kind->rest.data() + at;
    const int stride = posed_->kind->batches * kLanes;
    return {posed_->sample(at).cast<double>(), Eigen::Vector3d(rest[0], rest[stride], rest[2 * stride])};
}

}  // namespace sim
