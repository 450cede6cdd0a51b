#include "contact/convex_distance.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace sim {
namespace {

constexpr int kMostSupports = 48;

struct Vertex {
    Eigen::Vector3d w;     // of A - B
    Eigen::Vector3d a, b;  // from the centres, world axes
    Eigen::Vector3d rest_a, rest_b;
};

// Points of which the nearest to the origin is sum weight w; at most four.
struct Simplex {
    int count = 0;
    std::array<Vertex, 4> vertex;
    std::array<double, 4> weight{};

    [[nodiscard]] const Eigen::Vector3d& w(int i) const { return vertex[static_cast<std::size_t>(i)].w; }
    template <typename Member>
    [[nodiscard]] Eigen::Vector3d mean(Member member) const {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
            sum += weight[i] * (vertex[i].*member);
        return sum;
    }
};

// Weights of up to three of a simplex's points.
struct Face {
    int count;
    std::array<int, 3> of;
    std::array<double, 3> weight;
    double square;  // of the distance
};

Face nearest_on_edge(const Simplex& s, int i, int j) {
    const Eigen::Vector3d &a = s.w(i), &b = s.w(j), ab = b - a;
    const double length = ab.squaredNorm(), t = length > 0 ? -a.dot(ab) / length : 0;
    if (!(t > 0)) return {1, {i, 0, 0}, {1, 0, 0}, a.squaredNorm()};
    if (t >= 1) return {1, {j, 0, 0}, {1, 0, 0}, b.squaredNorm()};
    return {2, {i, j, 0}, {1 - t, t, 0}, (a + t * ab).squaredNorm()};
}

// Inside its edges where the origin's foot is, else the nearest of its edges.
Face nearest_on_triangle(const Simplex& s, int i, int j, int k) {
    const Eigen::Vector3d &a = s.w(i), &b = s.w(j), &c = s.w(k);
    const Eigen::Vector3d n = (b - a).cross(c - a);
    const double area = n.squaredNorm();
    if (area > 0) {
        const double u = b.cross(c).dot(n) / area, v = c.cross(a).dot(n) / area, w = 1 - u - v;
        if (u > 0 && v > 0 && w > 0) return {3, {i, j, k}, {u, v, w}, (u * a + v * b + w * c).squaredNorm()};
    }
    Face best = nearest_on_edge(s, i, j);
    for (const Face& other : {nearest_on_edge(s, j, k), nearest_on_edge(s, k, i)})
        if (other.square < best.square) best = other;
    return best;
}

void keep(const Face& face, Simplex& s) {
    Simplex kept;
    kept.count = face.count;
    for (std::size_t i = 0; i < static_cast<std::size_t>(face.count); ++i) {
        kept.vertex[i] = s.vertex[static_cast<std::size_t>(face.of[i])];
        kept.weight[i] = face.weight[i];
    }
    s = kept;
}

bool holds_origin(const Simplex& s) {
    const Eigen::Vector3d &a = s.w(0), &b = s.w(1), &c = s.w(2), &d = s.w(3);
    const double volume = (b - a).cross(c - a).dot(d - a);
    const double scale = (b - a).norm() * (c - a).norm() * (d - a).norm();
    if (!(std::abs(volume) > 1e-12 * scale)) return false;
    const double parts[4] = {b.cross(c).dot(d), -c.cross(d).dot(a), d.cross(a).dot(b), -a.cross(b).dot(c)};
    for (const double part : parts)
        if (part * volume < 0) return false;
    return true;
}

// Reduces the simplex to the least face that holds its nearest point to the origin; false: it holds the
// origin itself.
bool reduce(Simplex& s) {
    switch (s.count) {
        case 1:
            s.weight[0] = 1;
            return true;
        case 2:
            keep(nearest_on_edge(s, 0, 1), s);
            return true;
        case 3:
            keep(nearest_on_triangle(s, 0, 1, 2), s);
            return true;
        default:
            break;
    }
    if (holds_origin(s)) return false;
    Face best = nearest_on_triangle(s, 0, 1, 2);
    for (const Face& other :
         {nearest_on_triangle(s, 0, 1, 3), nearest_on_triangle(s, 0, 2, 3), nearest_on_triangle(s, 1, 2, 3)})
        if (other.square < best.square) best = other;
    keep(best, s);
    return true;
}

Vertex furthest(const PlacedConvex& a, const PlacedConvex& b, const Eigen::Vector3d& between,
                const Eigen::Vector3d& normal) {
    const ConvexBody::Point of_a = a.body->support(-(a.rotation.transpose() * normal));
    const ConvexBody::Point of_b = b.body->support(b.rotation.transpose() * normal);
    Vertex vertex;
    vertex.a = a.rotation * of_a.place, vertex.b = b.rotation * of_b.place;
    vertex.rest_a = of_a.rest, vertex.rest_b = of_b.rest;
    vertex.w = between + vertex.a - vertex.b;
    return vertex;
}

}  // namespace

ConvexDistance distance_between(const PlacedConvex& a, const PlacedConvex& b, double tolerance,
                                double share) noexcept {
    const Eigen::Vector3d between = a.position - b.position;
    const double margin = a.body->margin() + b.body->margin();
    ConvexDistance result;
    result.apart = false;
    result.gap = -1e300;
    const double start = between.norm();
    Eigen::Vector3d normal = start > 0 ? Eigen::Vector3d(between / start) : Eigen::Vector3d::UnitY();
    Simplex simplex;
    simplex.vertex[0] = furthest(a, b, between, normal);
    simplex.count = 1;
    double nearest = 1e300;
    for (int k = 0; k < kMostSupports; ++k) {
        if (!reduce(simplex)) return result;
        const Eigen::Vector3d v = simplex.mean(&Vertex::w);
        const double distance = v.norm();
        // No nearer than before: rounding.
        if (!(distance > 1e-3 * tolerance)) return result;
        const bool stuck = !(distance < nearest);
        nearest = std::min(nearest, distance);
        normal = v / distance;
        const Vertex w = furthest(a, b, between, normal);
        const double lower = normal.dot(w.w);
        if (lower > result.gap) result.gap = lower, result.normal = normal;
        if (stuck || distance - lower <= std::max(tolerance, share * (lower - margin)) ||
            k + 1 == kMostSupports)
            break;
        simplex.vertex[static_cast<std::size_t>(simplex.count++)] = w;
    }
    if (!(result.gap > 0)) return result;
    result.apart = true;
    result.gap -= margin;
    result.arm_a = simplex.mean(&Vertex::a) - a.body->margin() * result.normal;
    result.arm_b = simplex.mean(&Vertex::b) + b.body->margin() * result.normal;
    result.rest_a = simplex.mean(&Vertex::rest_a);
    result.rest_b = simplex.mean(&Vertex::rest_b);
    return result;
}

}  // namespace sim
