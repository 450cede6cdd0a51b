#include "modes/cell_rule.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "shape/superquadric.h"

namespace sim {
namespace {

constexpr int kGauss = 3, kFit = 5;
const std::array<double, kGauss> kGaussPoint = {-std::sqrt(0.6), 0, std::sqrt(0.6)};
constexpr std::array<double, kGauss> kGaussWeight = {5 / 9.0, 8 / 9.0, 5 / 9.0};

// Points within a cell, -1 to 1: those of five-point Gauss.
const double kInner = std::sqrt(5 - 2 * std::sqrt(10 / 7.0)) / 3;
const double kOuter = std::sqrt(5 + 2 * std::sqrt(10 / 7.0)) / 3;
const std::array<double, kFit> kFitPoint = {-kOuter, -kInner, 0, kInner, kOuter};

using Fit = Eigen::Matrix<double, kFit, 1>;
using FitPlane = Eigen::Matrix<double, kFit, kFit>;

// The five Lagrange polynomials through kFitPoint.
Fit lagrange(double t) {
    Fit value = Fit::Ones();
    for (int i = 0; i < kFit; ++i)
        for (int j = 0; j < kFit; ++j)
            if (i != j) value[i] *= (t - kFitPoint[j]) / (kFitPoint[i] - kFitPoint[j]);
    return value;
}

// Double-exponential rule on [0, 1]: endpoints may be algebraic singularities. Distances from both ends are
// kept, so that neither loses digits.
struct EndpointNode {
    double from_left, from_right, weight;
};

std::vector<EndpointNode> tanh_sinh() {
    constexpr double kStep = 1 / 7.0, kReach = 3.2;  // the ends' distances fall to 1e-17
    std::vector<EndpointNode> nodes;
    const int reach = static_cast<int>(kReach / kStep);
    for (int i = -reach; i <= reach; ++i) {
        const double t = i * kStep, u = M_PI * std::sinh(t);
        const double left = 1 / (1 + std::exp(-u)), right = 1 / (1 + std::exp(u));
        nodes.push_back({left, right, kStep * M_PI * std::cosh(t) * left * right});
    }
    return nodes;
}

// (1 - (1 - gap)^p)^(1/p): the other coordinate on the unit curve, from the distance to the end.
double complement_of_gap(double gap, double p) {
    return gap >= 1 ? 1 : std::pow(-std::expm1(p * std::log1p(-gap)), 1 / p);
}

double complement(double u, double p) {
    return u >= 1 ? 0 : std::pow(-std::expm1(p * std::log(u)), 1 / p);
}

std::vector<double> sorted(std::vector<double> borders) {
    std::sort(borders.begin(), borders.end());
    const auto same = [](double a, double b) { return b - a < 1e-13; };
    borders.erase(std::unique(borders.begin(), borders.end(), same), borders.end());
    return borders;
}

class SuperquadricIntegral {
public:
    SuperquadricIntegral(const Superquadric& shape, int elements)
        : axis_{elements}, p1_(2 / Gauge(shape).e1()), p2_(2 / Gauge(shape).e2()), nodes_(tanh_sinh()) {
        const std::size_t n = static_cast<std::size_t>(axis_.cells());
        moments_.assign(n * n * n, Eigen::VectorXd::Zero(kFit * kFit * kFit));
        sections_.resize(n * n);
    }

    // Moments of the Lagrange polynomials of every cell, point (p, q, r) at p + 5 (q + 5 r).
    std::vector<Eigen::VectorXd> run() {
        const std::vector<double> borders = height_borders();
        for (std::size_t i = 0; i + 1 < borders.size(); ++i)
            for (const EndpointNode& node : nodes_) add_height(borders[i], borders[i + 1], node);
        return moments_;
    }

private:
    [[nodiscard]] double cell_coordinate(int cell, double x) const {
        return (2 * x - axis_.lower(cell) - axis_.upper(cell)) / (axis_.upper(cell) - axis_.lower(cell));
    }
    [[nodiscard]] int cell_of(double x) const {
        int cell = 0;
        while (cell + 1 < axis_.cells() && x > axis_.upper(cell)) ++cell;
        return cell;
    }

    // Heights between which the integral over the section is smooth in the height.
    [[nodiscard]] std::vector<double> height_borders() const {
        std::vector<double> borders = {0, 1};
        for (int i = 0; i + 1 < axis_.cells(); ++i) {
            const double edge = axis_.upper(i);
            borders.push_back(edge);
            borders.push_back(complement(edge, p1_));
            for (int j = 0; j <= i; ++j) {
                const double corner = std::pow(std::pow(edge, p2_) + std::pow(axis_.upper(j), p2_), 1 / p2_);
                if (corner < 1) borders.push_back(complement(corner, p1_));
            }
        }
        return sorted(borders);
    }

    void add_height(double low, double high, const EndpointNode& node) {
        const double width = high - low, y = low + width * node.from_left;
        const double radius = complement_of_gap(1 - high + width * node.from_right, p1_);
        for (FitPlane& section : sections_) section.setZero();
        add_section(radius);
        const int cell = cell_of(y), n = axis_.cells();
        const Fit along = width * node.weight * lagrange(cell_coordinate(cell, y));
        for (int k = 0; k < n; ++k)
            for (int i = 0; i < n; ++i) spread(sections_[i + n * k], along, moments_[i + n * (cell + n * k)]);
    }

    static void spread(const FitPlane& section, const Fit& along, Eigen::VectorXd& moments) {
        for (int r = 0; r < kFit; ++r)
            for (int q = 0; q < kFit; ++q)
                moments.segment<kFit>(kFit * (q + kFit * r)) += along[q] * section.col(r);
    }

    // The quarter of the section |x|^p2 + |z|^p2 <= radius^p2.
    void add_section(double radius) {
        std::vector<double> borders = {0, radius};
        for (int i = 0; i + 1 < axis_.cells() && axis_.upper(i) < radius; ++i) {
            borders.push_back(axis_.upper(i));
            borders.push_back(radius * complement(axis_.upper(i) / radius, p2_));
        }
        borders = sorted(borders);
        for (std::size_t i = 0; i + 1 < borders.size(); ++i) {
            const double width = borders[i + 1] - borders[i];
            for (const EndpointNode& node : nodes_) {
                const double gap = (radius - borders[i + 1] + width * node.from_right) / radius;
                add_line(borders[i] + width * node.from_left, radius * complement_of_gap(gap, p2_),
                         width * node.weight);
            }
        }
    }

    void add_line(double x, double depth, double weight) {
        const int cell = cell_of(x), n = axis_.cells();
        const Fit across = weight * lagrange(cell_coordinate(cell, x));
        for (int k = 0; k < n && axis_.lower(k) < depth; ++k) {
            const double half = 0.5 * (std::min(depth, axis_.upper(k)) - axis_.lower(k));
            Fit deep = Fit::Zero();
            for (int g = 0; g < kGauss; ++g) {
                const double z = axis_.lower(k) + half * (1 + kGaussPoint[g]);
                deep += half * kGaussWeight[g] * lagrange(cell_coordinate(k, z));
            }
            sections_[cell + n * k] += across * deep.transpose();
        }
    }

    OctantAxis axis_;
    double p1_, p2_;
    std::vector<EndpointNode> nodes_;
    std::vector<Eigen::VectorXd> moments_;
    std::vector<FitPlane> sections_;
};

// Local coordinate of a point of a cell's own interval, -1 to 1.
double local_of(const OctantAxis& axis, int cell, double t) {
    const double low = axis.lower(cell), high = axis.upper(cell);
    return axis.local(cell, 0.5 * (low + high + t * (high - low)));
}

template <std::size_t count>
Eigen::Matrix3Xd tensor_points(const OctantAxis& axis, const std::array<int, 3>& cell,
                               const std::array<double, count>& line) {
    constexpr int n = static_cast<int>(count);
    Eigen::Matrix3Xd points(3, n * n * n);
    for (int i = 0; i < n * n * n; ++i)
        points.col(i) << local_of(axis, cell[0], line[i % n]), local_of(axis, cell[1], line[i / n % n]),
            local_of(axis, cell[2], line[i / n / n]);
    return points;
}

std::array<int, 3> cell_at(int index, int cells) {
    return {index % cells, index / cells % cells, index / cells / cells};
}

}  // namespace

OctantRule box_rule(int elements) {
    const OctantAxis axis{elements};
    const int cells = axis.cells();
    OctantRule rule(static_cast<std::size_t>(cells * cells * cells));
    for (int c = 0; c < cells * cells * cells; ++c) {
        const std::array<int, 3> cell = cell_at(c, cells);
        double volume = 1;
        for (const int i : cell) volume *= 0.5 * (axis.upper(i) - axis.lower(i));
        rule[c].points = tensor_points(axis, cell, kGaussPoint);
        rule[c].weights.resize(kGauss * kGauss * kGauss);
        for (int i = 0; i < kGauss * kGauss * kGauss; ++i)
            rule[c].weights[i] = volume * kGaussWeight[i % 3] * kGaussWeight[i / 3 % 3] * kGaussWeight[i / 9];
    }
    return rule;
}

OctantRule superquadric_rule(const Superquadric& shape, int elements) {
    const OctantAxis axis{elements};
    const std::vector<Eigen::VectorXd> moments = SuperquadricIntegral(shape, elements).run();
    OctantRule rule(moments.size());
    for (std::size_t c = 0; c < moments.size(); ++c)
        rule[c] = {tensor_points(axis, cell_at(static_cast<int>(c), axis.cells()), kFitPoint), moments[c]};
    return rule;
}

}  // namespace sim
