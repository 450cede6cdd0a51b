#include "sim/superquadric_fit.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <unsupported/Eigen/NonLinearOptimization>
#include <unsupported/Eigen/NumericalDiff>
#include <vector>

#include "shape/closest_point.h"
#include "shape/superquadric.h"

namespace sim {
namespace {

constexpr double kLowestExponent = 0.1, kExponentSpan = 1.8;
constexpr int kMostEvaluations = 60;  // of each start, its derivatives not counted

/// x: logarithms of the semi-axes, exponents as e = 0.1 + 1.8 / (1 + exp(-x)), centre.
struct FittedShape {
    Superquadric shape;
    Eigen::Vector3d centre;

    explicit FittedShape(const Eigen::VectorXd& x) : centre(x.tail<3>()) {
        const auto exponent = [](double t) { return kLowestExponent + kExponentSpan / (1 + std::exp(-t)); };
        shape.semi_axes = x.head<3>().array().max(-20).min(20).exp();
        shape.e1 = exponent(x[3]), shape.e2 = exponent(x[4]);
    }
    static Eigen::VectorXd parameters(double e1, double e2) {
        const auto logit = [](double e) { return -std::log(kExponentSpan / (e - kLowestExponent) - 1); };
        Eigen::VectorXd x = Eigen::VectorXd::Zero(8);  // of the unit cube
        x[3] = logit(e1), x[4] = logit(e2);
        return x;
    }
};

/// The residuals, as Eigen's Levenberg-Marquardt wants them.
struct InsideOutside {
    using Scalar = double;
    using InputType = Eigen::VectorXd;
    using ValueType = Eigen::VectorXd;
    using JacobianType = Eigen::MatrixXd;
    enum { InputsAtCompileTime = Eigen::Dynamic, ValuesAtCompileTime = Eigen::Dynamic };

    std::span<const Eigen::Vector3d> points;

    [[nodiscard]] int inputs() const { return 8; }
    [[nodiscard]] int values() const { return static_cast<int>(points.size()); }
    int operator()(const Eigen::VectorXd& x, Eigen::VectorXd& residuals) const {
        const FittedShape fitted(x);
        const Gauge gauge(fitted.shape);
        const double weight = std::sqrt(fitted.shape.semi_axes.prod());
        for (std::size_t i = 0; i < points.size(); ++i) {
            const double n = gauge.value(points[i] - fitted.centre);  // F^e1 = N^2
            residuals[static_cast<Eigen::Index>(i)] = weight * (n * n - 1);
        }
        return 0;
    }
};

}  // namespace

SurfaceError surface_error(const Superquadric& shape, const Eigen::Vector3d& centre,
                           std::span<const Eigen::Vector3d> points) {
    const Gauge gauge(shape);
    SurfaceError error;
    double squares = 0;
    for (const Eigen::Vector3d& point : points) {
        const double distance = std::abs(closest_point(gauge, {}, point - centre).distance);
        squares += distance * distance;
        if (distance > error.greatest_m) error.greatest_m = distance, error.farthest = point;
    }
    if (!points.empty()) error.rms_m = std::sqrt(squares / static_cast<double>(points.size()));
    return error;
}

SuperquadricFit fit_superquadric(std::span<const Eigen::Vector3d> points) {
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& point : points) box.extend(point);
    if (points.size() < 16 || !(box.sizes().minCoeff() > 1e-6 * box.sizes().maxCoeff()))
        throw std::invalid_argument("fit_superquadric: found points in a plane, expected a body's surface");
    const Eigen::Vector3d half = 0.5 * box.sizes(), middle = box.center();
    std::vector<Eigen::Vector3d> scaled;
    for (const Eigen::Vector3d& point : points) scaled.emplace_back((point - middle).cwiseQuotient(half));
    Eigen::NumericalDiff<InsideOutside> residuals{InsideOutside{scaled}};
    double least = std::numeric_limits<double>::infinity();
    Eigen::VectorXd best;
    for (const auto& [e1, e2] : {std::array{0.2, 1.0}, {1.0, 1.0}, {0.2, 0.2}, {1.7, 1.0}}) {
        Eigen::VectorXd x = FittedShape::parameters(e1, e2);
        Eigen::LevenbergMarquardt<Eigen::NumericalDiff<InsideOutside>> search(residuals);
        search.parameters.maxfev = kMostEvaluations;
        (void)search.minimize(x);
        if (x.allFinite() && search.fnorm < least) least = search.fnorm, best = x;
    }
    if (best.size() == 0)
        throw std::invalid_argument(
            "fit_superquadric: found points that no search fits, expected a body's surface");
    const FittedShape fitted(best);
    SuperquadricFit fit;
    fit.shape = fitted.shape;
    fit.shape.semi_axes = fitted.shape.semi_axes.cwiseProduct(half);
    fit.centre = middle + fitted.centre.cwiseProduct(half);
    fit.error = surface_error(fit.shape, fit.centre, points);
    return fit;
}

}  // namespace sim
