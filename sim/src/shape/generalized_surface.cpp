#include "shape/generalized_surface.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr double kCentre = 1e-100;     // smaller, squares vanish
constexpr double kNegligible = 1e-16;  // exp(-37), share of a bump's height

// Bodies are convex: of two bearing planes the one that leaves r farther out is nearer the truth.
void keep_farther_out(SurfacePoint& best, const SurfacePoint& other) {
    if (other.distance > best.distance) best = other;
}

Eigen::Vector3d signs(const Eigen::Vector3d& r) {
    return Eigen::Vector3d(std::copysign(1, r.x()), std::copysign(1, r.y()), std::copysign(1, r.z()));
}

struct SquaredAngle {
    double value, slope;  // theta^2 and its derivative by cos(theta)
};

// From |a - b|^2 = 2 - 2 cos(theta), exact also for small angles.
SquaredAngle squared_angle(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    const double half_sine = std::min(1.0, (a - b).norm() / 2);
    const double theta = 2 * std::asin(half_sine), sine = std::max(std::sin(theta), 1e-9);
    return {theta * theta, theta < 1e-6 ? -2 : -2 * theta / sine};
}

}  // namespace

GeneralizedSurface::GeneralizedSurface(const GeneralizedSuperquadric& shape) : base_(shape.base) {
    const Eigen::Vector3d& axes = base_.semi_axes();
    inverse_squares_ = axes.cwiseAbs2().cwiseInverse();
    ellipsoid_ = base_.e1() == 1 && base_.e2() == 1;
    sphere_ = ellipsoid_ && axes.maxCoeff() == axes.minCoeff();
    axes.minCoeff(&thinnest_);
    for (const Bump& bump : shape.bumps) {
        if (bump.height_m == 0) continue;
        peaks_.push_back({bump.direction.cwiseQuotient(axes).normalized(), bump.height_m,
                          1 / (bump.width_rad * bump.width_rad)});
    }
    // A direction whose nearest spike is i is at least half their angle from every other.
    for (const Peak& i : peaks_) {
        double sum = 0;
        for (const Peak& j : peaks_)
            sum += std::max(0.0, j.height) *
                   std::exp(-squared_angle(i.direction, j.direction).value / 4 * j.inverse_width_squared);
        reach_ = std::max(reach_, sum);
    }
}

GeneralizedSurface::Bearing GeneralizedSurface::bearing(const Eigen::Vector3d& y,
                                                        const Eigen::Vector3d& r) const noexcept {
    Eigen::Vector3d gradient;  // times what is at hand
    double n, offset;
    if (ellipsoid_) {
        gradient = y.cwiseProduct(inverse_squares_);
        n = offset = std::sqrt(gradient.dot(y));
    } else {
        const GaugeSlope slope = base_.slope(y);
        gradient = slope.gradient;
        n = slope.value;
        offset = 1;
    }
    if (!(n > kCentre)) return {0, {-base_.semi_axes()[thinnest_], Eigen::Vector3d::Unit(thinnest_)}};
    const double inverse = 1 / gradient.norm();
    return {n, {(gradient.dot(r) - offset) * inverse, gradient * inverse}};
}

SurfacePoint GeneralizedSurface::towards_foot(const Eigen::Vector3d& r, SurfacePoint best) const noexcept {
    const Bearing foot = bearing(r - best.distance * best.normal, r);
    if (foot.n > 0) keep_farther_out(best, foot.plane);
    return best;
}

SurfacePoint GeneralizedSurface::base_distance(const Eigen::Vector3d& r) const noexcept {
    const Bearing at = bearing(r, r);
    if (at.n >= 1 || sphere_) return at.plane;
    SurfacePoint best = at.plane;
    if (base_.has_kinks()) {
        const Eigen::Vector3d beside = signs(r).cwiseProduct(Eigen::Vector3d(1, 0.8, 0.6));
        const Bearing raised = bearing(r - best.distance * beside, r);
        if (raised.n > 0) keep_farther_out(best, raised.plane);
    }
    return towards_foot(r, best);
}

SurfacePoint GeneralizedSurface::distance(const Eigen::Vector3d& r) const noexcept {
    return peaks_.empty() ? base_distance(r) : bumped(r);
}

GeneralizedSurface::Displacement GeneralizedSurface::displacement(const Eigen::Vector3d& r) const noexcept {
    Displacement sum{0, Eigen::Vector3d::Zero()};
    const Eigen::Vector3d u = r.cwiseQuotient(base_.semi_axes());
    const double length = u.norm();
    if (length < 1e-100) return sum;
    const Eigen::Vector3d unit = u / length;
    for (const Peak& peak : peaks_) {
        const SquaredAngle angle = squared_angle(unit, peak.direction);
        const double share = std::exp(-angle.value * peak.inverse_width_squared);
        if (share < kNegligible) continue;
        sum.value += peak.height * share;
        const Eigen::Vector3d cosine_slope = (peak.direction - unit.dot(peak.direction) * unit) / length;
        sum.gradient -= peak.height * share * peak.inverse_width_squared * angle.slope * cosine_slope;
    }
    sum.gradient = sum.gradient.cwiseQuotient(base_.semi_axes());
    return sum;
}

Eigen::Vector3d GeneralizedSurface::surface_point(const Eigen::Vector3d& r) const noexcept {
    const Eigen::Vector3d p = base_.onto_surface(r);
    return p + displacement(p).value * base_.derivatives(p).gradient.normalized();
}

SurfacePoint GeneralizedSurface::bumped(const Eigen::Vector3d& r) const noexcept {
    SurfacePoint base = base_distance(r);
    if (base.distance > 0) base = towards_foot(r, towards_foot(r, base));
    const Eigen::Vector3d foot = r - base.distance * base.normal;
    const Displacement moved = displacement(foot);
    // The foot follows r along the surface, slower the farther out r is: by R / (R + distance) on a sphere.
    const Eigen::Vector3d along = moved.gradient - base.normal.dot(moved.gradient) * base.normal;
    const double outer = r.norm(), follow = outer > 1e-100 ? std::min(2.0, foot.norm() / outer) : 0;
    const Eigen::Vector3d gradient = base.normal - follow * along;
    const double inverse = 1 / gradient.norm();
    return {(base.distance - moved.value) * inverse, gradient * inverse};
}

}  // namespace sim
