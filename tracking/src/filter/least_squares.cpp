#include "filter/least_squares.h"

#include <Eigen/QR>

#include "tracking/rotation.h"

namespace tracking {

LeastSquares::LeastSquares(int degree, std::size_t samples)
    : degree_(degree), samples_(samples), window_(SampleWindow::of_count(samples)) {
    coefficients_.setZero();
}

SampleStatus LeastSquares::correct(const PoseSample& sample) noexcept {
    const SampleStatus status = clock_.judge(sample);
    if (status != SampleStatus::accepted && status != SampleStatus::reinitialised) return status;
    if (status == SampleStatus::reinitialised) {
        window_.clear();
        started_ = false;
    } else if (!started_) {
        fill_before(sample.t_s - clock_.time_s());
        started_ = true;
    }
    clock_.advance(sample.t_s);
    window_.push(sample);
    fit();
    return status;
}

void LeastSquares::fill_before(double dt) noexcept {
    const PoseSample first = window_.back(0);
    window_.clear();
    for (std::size_t age = samples_; age-- > 0;) {
        PoseSample copy = first;
        copy.t_s -= static_cast<double>(age) * dt;
        window_.push(copy);
    }
}

void LeastSquares::fit() noexcept {
    using Design = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostSamples, kMostDegree + 1>;
    using Values = Eigen::Matrix<double, Eigen::Dynamic, 6, 0, kMostSamples, 6>;
    const auto n = static_cast<Eigen::Index>(window_.size());
    const Eigen::Index terms = n > degree_ ? degree_ + 1 : 1;
    const PoseSample& newest = window_.back(0);
    span_s_ = n > 1 ? newest.t_s - window_.back(static_cast<std::size_t>(n) - 1).t_s : 1;
    Design design(n, terms);
    Values values(n, 6);
    for (Eigen::Index row = 0; row < n; ++row) {
        const PoseSample& sample = window_.back(static_cast<std::size_t>(row));
        const double t = (sample.t_s - newest.t_s) / span_s_;
        design(row, 0) = 1;
        for (Eigen::Index k = 1; k < terms; ++k) design(row, k) = design(row, k - 1) * t;
        values.row(row) << (sample.position - newest.position).transpose(),
            logarithm(sample.orientation * newest.orientation.conjugate()).transpose();
    }
    coefficients_.setZero();
    coefficients_.topRows(terms) = Eigen::HouseholderQR<Design>(design).solve(values);
}

std::optional<Motion> LeastSquares::motion() const noexcept {
    if (degree_ > 2) return std::nullopt;
    const Eigen::Matrix<double, 1, 6> slope = coefficients_.row(1) / span_s_;
    const Eigen::Matrix<double, 1, 6> bend = 2 * coefficients_.row(2) / (span_s_ * span_s_);
    const PoseSample& newest = window_.back(0);
    Motion motion;
    motion.position = newest.position + coefficients_.row(0).head<3>().transpose();
    motion.velocity = slope.head<3>();
    motion.acceleration = bend.head<3>();
    motion.orientation = newest.orientation;
    motion.turn = coefficients_.row(0).tail<3>();
    motion.angular_velocity = slope.tail<3>();
    motion.angular_acceleration = bend.tail<3>();
    return motion;
}

PosePrediction LeastSquares::predict(double lead_s) const noexcept {
    const double t = lead_s / span_s_;
    Eigen::Matrix<double, 1, 6> value = coefficients_.row(kMostDegree);
    Eigen::Matrix<double, 1, 6> slope = Eigen::Matrix<double, 1, 6>::Zero();
    for (int k = kMostDegree - 1; k >= 0; --k) {
        slope = slope * t + value;
        value = value * t + coefficients_.row(k);
    }
    const PoseSample& newest = window_.back(0);
    PosePrediction pose;
    pose.position = newest.position + value.head<3>().transpose();
    pose.velocity = slope.head<3>().transpose() / span_s_;
    pose.orientation = (exponential(value.tail<3>().transpose()) * newest.orientation).normalized();
    pose.angular_velocity = slope.tail<3>().transpose() / span_s_;
    return pose;
}

}  // namespace tracking
