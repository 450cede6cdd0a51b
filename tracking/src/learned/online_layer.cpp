#include "learned/online_layer.h"

#include <cmath>

namespace tracking {
namespace {

constexpr double kUsualPeriodS = 1.0 / 60;
constexpr double kMostSpeed = 50;  // [m/s] that an example counts by
/// Beyond what fading velocities miss, even of a stick that turns round [s]; a jump of the tracker teaches no more.
constexpr double kMostResidual = 1;

}  // namespace

OnlineLayer::OnlineLayer(const Network& network, double memory_s)
    : memory_s_(memory_s),
      first_weights_(kPathMeans, network.units() + 1),
      moments_(Eigen::MatrixXd::Zero(network.units() + 1, network.units() + 1)),
      against_(Eigen::MatrixXd::Zero(network.units() + 1, kPathMeans)),
      matrix_(moments_),
      solution_(against_),
      x_(network.units() + 1),
      error_(kPathMeans) {
    first_weights_ << network.mean_weights().cast<double>(), network.mean_bias().cast<double>();
    weights_ = first_weights_.cast<float>();
}

bool OnlineLayer::learn(const Network::Hidden& hidden, const PathMeans& residuals, bool known_shaft,
                        double speed, double dt_s) noexcept {
    x_.head(x_.size() - 1) = hidden.head(x_.size() - 1).cast<double>();
    x_[x_.size() - 1] = 1;
    error_ = residuals.cast<double>().cwiseMax(-kMostResidual).cwiseMin(kMostResidual);
    error_.noalias() -= first_weights_ * x_;
    if (!known_shaft)
        for (std::size_t l = 0; l < kNodes; ++l)
            error_.segment<3>(static_cast<Eigen::Index>(6 * l + 3)).setZero();
    const double keep = std::exp(-dt_s / memory_s_), v = std::min(speed, kMostSpeed),
                 weight = v * v * dt_s / kUsualPeriodS;
    // The lower triangle, column by column.
    for (Eigen::Index j = 0; j < x_.size(); ++j) {
        auto column = moments_.col(j).tail(x_.size() - j);
        column = keep * column + (weight * x_[j]) * x_.tail(x_.size() - j);
    }
    for (Eigen::Index j = 0; j < error_.size(); ++j)
        against_.col(j) = keep * against_.col(j) + (weight * error_[j]) * x_;
    if (++since_ < kEvery) return false;
    since_ = 0;
    solve();
    return true;
}

void OnlineLayer::add(const Experience& other) {
    moments_ += other.moments;
    against_ += other.against;
}

/// By columns, each sum in one order: Eigen's own factorisation is parted to fit the processor's caches.
void OnlineLayer::solve() noexcept {
    matrix_ = moments_;
    matrix_.diagonal().array() += kDraw;
    const Eigen::Index n = matrix_.rows();
    for (Eigen::Index j = 0; j < n; ++j) {  // matrix_ becomes L of A + d I = L L^T
        auto column = matrix_.col(j).tail(n - j);
        if (!(column[0] > 0)) return;
        column /= std::sqrt(column[0]);
        for (Eigen::Index k = j + 1; k < n; ++k)
            matrix_.col(k).tail(n - k) -= matrix_(k, j) * matrix_.col(j).tail(n - k);
    }
    solution_ = against_;
    for (Eigen::Index r = 0; r < solution_.cols(); ++r) {
        auto x = solution_.col(r);
        for (Eigen::Index j = 0; j < n; ++j) {
            x[j] /= matrix_(j, j);
            x.tail(n - j - 1) -= x[j] * matrix_.col(j).tail(n - j - 1);
        }
        for (Eigen::Index j = n; j-- > 0;)
            x[j] = (x[j] - matrix_.col(j).tail(n - j - 1).dot(x.tail(n - j - 1))) / matrix_(j, j);
    }
    if (solution_.allFinite()) weights_ = (first_weights_ + solution_.transpose()).cast<float>();
}

}  // namespace tracking
