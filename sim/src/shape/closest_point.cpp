#include "shape/closest_point.h"

#include <array>
#include <cmath>

namespace sim {
namespace {

using Tangents = Eigen::Matrix<double, 3, 2>;

constexpr int kMaxSteps = 300;         // smooth shapes take 3-8; the sharpest kinks (exponent 1.9) this many
constexpr double kSettled_m = 1e-8;    // a Newton step this short leaves an error of its square
constexpr double kAtSurface_m = 1e-5;  // nearer, the direction to the foot is lost in rounding

struct Foot {
    Eigen::Vector3d r, y;
    double squared;  // |x - y|^2
};

Foot foot_at(const Gauge& gauge, const Deformation& d, const Eigen::Vector3d& x,
             const Eigen::Vector3d& near) {
    const Eigen::Vector3d r = gauge.onto_surface(near);
    const Eigen::Vector3d y = d.matrix * r;
    return {r, y, (x - y).squaredNorm()};
}

Tangents tangents_to(const Eigen::Vector3d& n) {
    // Duff et al. 2017, "Building an orthonormal basis, revisited"
    const double sign = std::copysign(1.0, n.z()), a = -1 / (sign + n.z()), b = n.x() * n.y() * a;
    Tangents t;
    t.col(0) << 1 + sign * n.x() * n.x() * a, sign * b, -sign * n.x();
    t.col(1) << b, sign + n.y() * n.y() * a, -n.y();
    return t;
}

struct TangentProblem {
    Eigen::Vector3d normal;
    Tangents tangents;
    Eigen::Vector2d pull;       // T^T (x - y)
    Eigen::Matrix2d curvature;  // T^T (I + lambda H) T
};

TangentProblem tangent_problem(const GaugeDerivatives& g, const Deformation& d, const Eigen::Vector3d& x,
                               const Foot& foot) {
    const Eigen::Vector3d gradient = d.inverse.transpose() * g.gradient;
    const double length = gradient.norm();
    TangentProblem problem;
    problem.normal = gradient / length;
    problem.tangents = tangents_to(problem.normal);
    const Eigen::Vector3d offset = x - foot.y;
    problem.pull = problem.tangents.transpose() * offset;
    const Tangents rest_tangents = d.inverse * problem.tangents;
    const Tangents bent = g.hessian * rest_tangents;
    problem.curvature = (offset.dot(problem.normal) / length) * (rest_tangents.transpose() * bent);
    problem.curvature.diagonal().array() += 1;
    return problem;
}

// Step of the damped 2x2 system; false when it is not positive definite.
bool solve_step(const TangentProblem& problem, double mu, Eigen::Vector2d& step) {
    const double a = problem.curvature(0, 0) + mu, c = problem.curvature(1, 1) + mu,
                 b = problem.curvature(0, 1);
    const double det = a * c - b * b;
    if (!(a > 0 && det > 1e-12 * a * c)) return false;
    step << (c * problem.pull.x() - b * problem.pull.y()) / det,
        (a * problem.pull.y() - b * problem.pull.x()) / det;
    return true;
}

Foot refine(const Gauge& gauge, const Deformation& d, const Eigen::Vector3d& x, Foot foot) {
    const auto problem_at = [&](const Foot& f) { return tangent_problem(gauge.derivatives(f.r), d, x, f); };
    double mu = 0;
    bool cautious = false;
    TangentProblem problem = problem_at(foot);
    for (int i = 0; i < kMaxSteps; ++i) {
        Eigen::Vector2d step;
        if (solve_step(problem, mu, step)) {
            const Foot next = foot_at(gauge, d, x, d.inverse * (foot.y + problem.tangents * step));
            const bool settled = step.squaredNorm() < kSettled_m * kSettled_m;
            if (next.squared <= foot.squared) {
                foot = next;
                if (settled) break;
                mu = mu < 0.1 ? 0 : 0.1 * mu;
                problem = problem_at(foot);
                cautious = false;
                continue;
            }
            if (settled) break;
        }
        if (gauge.has_kinks() && !cautious) {
            problem = tangent_problem(gauge.cautious_derivatives(foot.r), d, x, foot);
            cautious = true;
        } else {
            mu = 4 * mu + 0.5;
        }
    }
    return foot;
}

Foot nearest_from_inside(const Gauge& gauge, const Deformation& d, const Eigen::Vector3d& x,
                         const Eigen::Vector3d& r) {
    std::array<Foot, 4> feet = {foot_at(gauge, d, x, r), foot_at(gauge, d, x, gauge.along_axis(r, 0)),
                                foot_at(gauge, d, x, gauge.along_axis(r, 1)),
                                foot_at(gauge, d, x, gauge.along_axis(r, 2))};
    for (int i = 0; i < 2; ++i) {
        for (int j = i + 1; j < 4; ++j) {
            if (feet[j].squared < feet[i].squared) std::swap(feet[i], feet[j]);
        }
    }
    const Foot first = refine(gauge, d, x, feet[0]), second = refine(gauge, d, x, feet[1]);
    return second.squared < first.squared ? second : first;
}

}  // namespace

ClosestPoint closest_point(const Gauge& gauge, const Deformation& d, const Eigen::Vector3d& x,
                           const Eigen::Vector3d* start) noexcept {
    const Eigen::Vector3d r = d.inverse * x;
    const bool inside = gauge.value(r) < 1;
    Foot foot;
    if (start) {
        foot = refine(gauge, d, x, foot_at(gauge, d, x, *start));
    } else if (inside) {
        foot = nearest_from_inside(gauge, d, x, r);
    } else {
        foot = refine(gauge, d, x, foot_at(gauge, d, x, gauge.near_outside(r)));
    }
    const double distance = std::sqrt(foot.squared);
    // Outside, the direction to the foot is the normal also where an exponent above 1 makes the surface a
    // kink.
    const Eigen::Vector3d normal =
        !inside && distance > kAtSurface_m
            ? ((x - foot.y) / distance).eval()
            : (d.inverse.transpose() * gauge.derivatives(foot.r).gradient).normalized();
    return {inside ? -distance : distance, normal, foot.y, foot.r};
}

}  // namespace sim
