#include "shape/superquadric.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr double kSmallestExponent = 0.1, kLargestExponent = 1.9;
constexpr double kPlaneHeight = 1e-7;

// base^exponent; whole exponents (e = 0.1 gives 20) by squaring.
double power(double base, double exponent) {
    int n = static_cast<int>(exponent);
    if (n != exponent) return std::pow(base, exponent);
    double result = 1;
    for (; n > 0; n >>= 1, base *= base) {
        if (n & 1) result *= base;
    }
    return result;
}

// (1 + t)^(1/p) for t in [0, 1]; the series' first left-out term is below 1e-17.
double root_of_one_plus(double t, double p) {
    if (p == 2) return std::sqrt(1 + t);
    if (t > 1e-4) return std::pow(1 + t, 1 / p);
    const double k = 1 / p;
    return 1 + k * t * (1 + (k - 1) / 2 * t * (1 + (k - 2) / 3 * t * (1 + (k - 3) / 4 * t)));
}

// (u^p + w^p)^(1/p) for u, w >= 0 without overflow, and the share u^p / (u^p + w^p) of the first.
struct PairNorm {
    double value, first, second;
};

PairNorm pair_norm(double u, double w, double p) {
    const double large = std::max(u, w), small = std::min(u, w);
    if (large == 0) return {0, 1, 0};
    const double t = power(small / large, p);
    const double root = root_of_one_plus(t, p);
    const double major = 1 / (1 + t), minor = t / (1 + t);
    return u >= w ? PairNorm{large * root, major, minor} : PairNorm{large * root, minor, major};
}

// The second coordinate on the unit curve first^p + second^p = 1.
double complement(double first, double p) {
    return std::pow(std::max(0.0, 1 - power(first, p)), 1 / p);
}

// Bounds the Euclidean norm on the surface: a p-norm of two numbers is at most 2^max(0, 1/2 - 1/p) short of
// the 2-norm.
double growth(double p) {
    return std::pow(2.0, std::max(0.0, 0.5 - 1 / p));
}

}  // namespace

Gauge::Gauge(const Superquadric& shape)
    : semi_axes_(shape.semi_axes),
      e1_(std::clamp(shape.e1, kSmallestExponent, kLargestExponent)),
      e2_(std::clamp(shape.e2, kSmallestExponent, kLargestExponent)),
      p1_(2 / e1_),
      p2_(2 / e2_) {
    const double flat = growth(p2_) * std::max(semi_axes_.x(), semi_axes_.z());
    bounding_radius_ =
        std::min(std::hypot(flat, semi_axes_.y()), growth(p1_) * std::max(flat, semi_axes_.y()));
}

double Gauge::value(const Eigen::Vector3d& r) const noexcept {
    const Eigen::Vector3d u = r.cwiseAbs().cwiseQuotient(semi_axes_);
    return pair_norm(pair_norm(u.x(), u.z(), p2_).value, u.y(), p1_).value;
}

GaugeSlope Gauge::slope(const Eigen::Vector3d& r) const noexcept {
    const Eigen::Vector3d u = r.cwiseAbs().cwiseQuotient(semi_axes_);
    const PairNorm flat = pair_norm(u.x(), u.z(), p2_);
    const PairNorm whole = pair_norm(flat.value, u.y(), p1_);
    if (whole.value == 0) return {0, Eigen::Vector3d::Zero()};
    // d n / d|u_i| = share n / u_i; a coordinate of no size has no share. Shares of x and z are of rho's.
    const double n = whole.value;
    const Eigen::Vector3d share(whole.first * flat.first, whole.second, whole.first * flat.second);
    Eigen::Vector3d gradient;
    for (int i = 0; i < 3; ++i) gradient[i] = u[i] == 0 ? 0 : share[i] * n / r[i];
    return {n, gradient};
}

double Gauge::inside_outside(const Eigen::Vector3d& r) const noexcept {
    return power(value(r), p1_);
}

GaugeDerivatives Gauge::derivatives(const Eigen::Vector3d& r) const noexcept {
    return derivatives(r, p1_ - 1, p2_ - 1);
}

GaugeDerivatives Gauge::cautious_derivatives(const Eigen::Vector3d& r) const noexcept {
    return derivatives(r, std::max(p1_ - 1, 1.0), std::max(p2_ - 1, 1.0));
}

GaugeDerivatives Gauge::derivatives(const Eigen::Vector3d& r, double curve1, double curve2) const noexcept {
    const Eigen::Vector3d exact = r.cwiseAbs().cwiseQuotient(semi_axes_);
    const double lowest = kPlaneHeight * exact.maxCoeff();
    const Eigen::Vector3d u = exact.cwiseMax(lowest);
    const PairNorm flat = pair_norm(u.x(), u.z(), p2_);
    const PairNorm whole = pair_norm(flat.value, u.y(), p1_);
    const double rho = flat.value, n = whole.value;
    const double n_rho = whole.first * n / rho;
    const Eigen::Vector3d rho_gradient(flat.first * rho / u.x(), 0, flat.second * rho / u.z());

    Eigen::Vector3d gradient = n_rho * rho_gradient;
    gradient.y() = whole.second * n / u.y();
    const Eigen::Vector3d bend_flat(rho / u.x(), 0, -rho / u.z());
    const Eigen::Vector3d bend_whole(rho_gradient.x() * n / rho, -n / u.y(), rho_gradient.z() * n / rho);
    const double flat_rate = n_rho * curve2 * flat.first * flat.second / rho;
    const double whole_rate = curve1 * whole.first * whole.second / n;

    Eigen::Vector3d scale;  // d|x/a| / dx
    for (int i = 0; i < 3; ++i) {
        scale[i] = (r[i] < 0 ? -1 : 1) / semi_axes_[i];
        gradient[i] *= scale[i] * (exact[i] < lowest ? exact[i] / lowest : 1);
    }
    const Eigen::Vector3d a = bend_flat.cwiseProduct(scale), b = bend_whole.cwiseProduct(scale);
    return {gradient, flat_rate * a * a.transpose() + whole_rate * b * b.transpose()};
}

Eigen::Vector3d Gauge::onto_surface(const Eigen::Vector3d& r) const noexcept {
    const double n = value(r);
    if (n < 1e-12) return Eigen::Vector3d(0, semi_axes_.y(), 0);
    return r / n;
}

// N(r) = 1 and d parallel to grad N(r): with u = |d| times the semi-axes and q = p / (p - 1), the share
// u_i^q / sum u^q of a coordinate in the dual norm is |r_i / a_i|^p, its share in N.
Eigen::Vector3d Gauge::support(const Eigen::Vector3d& direction) const noexcept {
    if (p1_ == 2 && p2_ == 2) {
        const Eigen::Vector3d pulled = semi_axes_.cwiseProduct(direction);
        const double length = pulled.norm();
        return length > 0 ? Eigen::Vector3d(semi_axes_.cwiseProduct(pulled) / length)
                          : Eigen::Vector3d(0, semi_axes_.y(), 0);
    }
    const Eigen::Vector3d u = direction.cwiseAbs().cwiseProduct(semi_axes_);
    const PairNorm flat = pair_norm(u.x(), u.z(), p2_ / (p2_ - 1));
    const PairNorm whole = pair_norm(flat.value, u.y(), p1_ / (p1_ - 1));
    const double rho = std::pow(whole.first, 1 / p1_);
    const Eigen::Vector3d r(rho * std::pow(flat.first, 1 / p2_), std::pow(whole.second, 1 / p1_),
                            rho * std::pow(flat.second, 1 / p2_));
    Eigen::Vector3d point;
    for (int i = 0; i < 3; ++i) point[i] = std::copysign(r[i] * semi_axes_[i], direction[i]);
    return point;
}

Eigen::Vector3d Gauge::near_outside(const Eigen::Vector3d& r) const noexcept {
    if (e1_ >= 0.6) return onto_surface(r);
    const Eigen::Vector3d u = r.cwiseAbs().cwiseQuotient(semi_axes_);
    const double flat = 1 / std::max(1.0, pair_norm(u.x(), u.z(), p2_).value);
    return onto_surface(Eigen::Vector3d(flat * r.x(), r.y() / std::max(1.0, u.y()), flat * r.z()));
}

Eigen::Vector3d Gauge::along_axis(const Eigen::Vector3d& r, int axis) const noexcept {
    const Eigen::Vector3d u = r.cwiseAbs().cwiseQuotient(semi_axes_);
    double height;
    if (axis == 1) {
        height = complement(std::min(1.0, pair_norm(u.x(), u.z(), p2_).value), p1_);
    } else {
        const double rho = complement(std::min(1.0, u.y()), p1_);
        const double other = axis == 0 ? u.z() : u.x();
        height = other < rho ? rho * complement(other / rho, p2_) : 0;
    }
    Eigen::Vector3d moved = r;
    moved[axis] = std::copysign(height * semi_axes_[axis], r[axis]);
    return onto_surface(moved);
}

}  // namespace sim
