#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "trace/random_stream.h"
#include "tracking/trace.h"

namespace tracking {

/// Linear stochastic motion x' = A x + g w of one axis' state x = [p, v, a], w white of density q, worked out
/// apart from the library: F by the series of exp(A dt), Q by Van Loan's block exponential.
struct LinearMotion {
    int order;         ///< of the state: 2 (constant velocity) or 3
    double alpha = 0;  ///< decay of the last component [1/s]
    double q = 0;      ///< [m^2/s^3] for order 2, [m^2/s^5] for order 3
    Eigen::Vector3d jump =
        Eigen::Vector3d::Zero();  ///< standard deviations added at each step, whatever its dt

    /// F(dt) and a lower triangular L with L L^T = Q(dt).
    struct Step {
        Eigen::Matrix3d f, l;
    };
    [[nodiscard]] Step step(double dt) const;
};

/// L with L L^T = m for a positive semidefinite matrix: zero pivots give zero columns.
inline Eigen::Matrix3d lower_root(const Eigen::Matrix3d& m) {
    Eigen::Matrix3d l = Eigen::Matrix3d::Zero();
    for (int j = 0; j < 3; ++j) {
        const double pivot = m(j, j) - l.row(j).head(j).squaredNorm();
        if (pivot <= 0) continue;
        l(j, j) = std::sqrt(pivot);
        for (int i = j + 1; i < 3; ++i)
            l(i, j) = (m(i, j) - l.row(i).head(j).dot(l.row(j).head(j))) / l(j, j);
    }
    return l;
}

inline LinearMotion::Step LinearMotion::step(double dt) const {
    if (dt == 0) return {Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Zero()};
    // In the unit of time dt, so that all entries are of order 1.
    Eigen::Matrix<double, 6, 6> block = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    a(0, 1) = 1;
    a(order - 1, order - 1) = -alpha * dt;
    if (order == 3) a(1, 2) = 1;
    block.topLeftCorner<3, 3>() = -a;
    block(order - 1, order + 2) = 1;
    block.bottomRightCorner<3, 3>() = a.transpose();
    Eigen::Matrix<double, 6, 6> sum = Eigen::Matrix<double, 6, 6>::Identity();
    Eigen::Matrix<double, 6, 6> term = sum;
    for (int k = 1; k <= 30; ++k) sum += term = (term * block / k).eval();
    const Eigen::Matrix3d f = sum.bottomRightCorner<3, 3>().transpose();
    const Eigen::Vector3d scale =
        order == 3 ? Eigen::Vector3d(dt * dt, dt, 1) : Eigen::Vector3d(dt, 1, 1 / dt);
    return {scale.asDiagonal() * f * scale.cwiseInverse().asDiagonal(),
            std::sqrt(q * dt) * (scale.asDiagonal() * lower_root(f * sum.topRightCorner<3, 3>())) +
                Eigen::Matrix3d(jump.asDiagonal())};
}

/// States of the three axes as columns.
using AxisColumns = Eigen::Matrix3d;

inline AxisColumns normal_columns(RandomStream& random) {
    AxisColumns n;
    for (int axis = 0; axis < 3; ++axis) n.col(axis) = random.normal_vector(1);
    return n;
}

inline AxisColumns moved(const LinearMotion::Step& step, const AxisColumns& x, RandomStream& random) {
    return step.f * x + step.l * normal_columns(random);
}

/// Motion that switches between models as a Markov process: out of each at `rate` over a step (stays with
/// probability exp(-rate dt)), to the others alike. Rate 0: no switching.
struct World {
    std::vector<LinearMotion> models;
    double rate = 0;
    std::size_t mode = 0;
    AxisColumns x = AxisColumns::Zero();

    void advance(double dt, RandomStream& random) {
        if (rate > 0 && random.uniform() > std::exp(-rate * dt)) {
            const double other = random.uniform() * static_cast<double>(models.size() - 1);
            mode = (mode + 1 + std::min(static_cast<std::size_t>(other), models.size() - 2)) % models.size();
        }
        x = moved(models[mode].step(dt), x, random);
    }
    /// The world `lead` later, in steps as near to `dt` as divide the lead.
    [[nodiscard]] World after(double lead, double dt, RandomStream& random) const {
        World later = *this;
        const int pieces = rate > 0 ? std::max(1, static_cast<int>(std::lround(lead / dt))) : 1;
        for (int i = 0; i < pieces; ++i) later.advance(lead / pieces, random);
        return later;
    }
};

inline PoseSample position_sample(double t, const Eigen::Vector3d& position) {
    PoseSample sample;
    sample.t_s = t;
    sample.position = position;
    return sample;
}

/// Sums of a normalised square (a sample of chi-square with `3 n` degrees of freedom over n values) at each
/// step, and in all.
class NormalisedSquares {
public:
    explicit NormalisedSquares(std::size_t steps) : per_step_(steps, 0.0) {}

    /// The squares of one run, one a step, each of mean 3 where the statement is honest.
    void add_run(const std::vector<double>& squares) {
        double sum = 0;
        for (std::size_t k = 0; k < squares.size(); ++k) per_step_[k] += squares[k], sum += squares[k];
        const double mean = sum / (3.0 * static_cast<double>(squares.size()));
        ++runs_, sum_ += mean, sum_of_squares_ += mean * mean;
    }
    /// Mean over everything, 1 where honest, and its standard error from the runs, which are independent.
    [[nodiscard]] double mean() const { return sum_ / runs_; }
    [[nodiscard]] double standard_error() const {
        return std::sqrt((sum_of_squares_ / runs_ - mean() * mean()) / (runs_ - 1));
    }
    /// Share of the steps whose mean over the runs lies within the central 95 % of chi-square with 3 n
    /// degrees of freedom over 3 n (Wilson and Hilferty's approximation, good to 1e-4 here).
    [[nodiscard]] double share_inside() const {
        const double spread = 2 / (9 * 3 * runs_);
        const auto bound = [&](double z) { return std::pow(1 - spread + z * std::sqrt(spread), 3); };
        const auto inside = std::count_if(per_step_.begin(), per_step_.end(), [&](double sum) {
            const double mean = sum / (3 * runs_);
            return mean > bound(-1.96) && mean < bound(1.96);
        });
        return static_cast<double>(inside) / static_cast<double>(per_step_.size());
    }

private:
    std::vector<double> per_step_;
    double runs_ = 0, sum_ = 0, sum_of_squares_ = 0;
};

}  // namespace tracking
