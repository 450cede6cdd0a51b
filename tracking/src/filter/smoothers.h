#pragma once
#include "filter/sample_clock.h"
#include "tracking/predictor.h"

namespace tracking {

/// Double exponential smoothing (LaViola, "Double Exponential Smoothing: An Alternative to Kalman
/// Filter-Based Predictive Tracking", 2003):
///
///   s1 <- a z + (1 - a) s1,  s2 <- a s1 + (1 - a) s2
///   predict (2 + r) s1 - (1 + r) s2,  r = a lead / ((1 - a) dt)
///
/// dt is the newest step: the method knows no other. Orientations likewise, with slerp for the sums (LaViola
/// adds quaternions and normalises, which lags on fast turns). No allocation.
class DoubleExponential final : public Predictor {
public:
    /// 0 < a < 1.
    explicit DoubleExponential(double a) : a_(a) {}

    [[nodiscard]] SampleStatus correct(const PoseSample& sample) noexcept override;
    [[nodiscard]] PosePrediction predict(double lead_s) const noexcept override;
    [[nodiscard]] double time_s() const noexcept override { return clock_.time_s(); }
    [[nodiscard]] std::optional<Motion> motion() const noexcept override;

private:
    SampleClock clock_;
    double a_;
    double dt_ = 0;  ///< 0 until there are two samples
    Eigen::Vector3d p1_ = Eigen::Vector3d::Zero(), p2_ = Eigen::Vector3d::Zero();
    Eigen::Quaterniond q1_ = Eigen::Quaterniond::Identity(), q2_ = Eigen::Quaterniond::Identity();
};

/// The 1 euro filter (Casiez, Roussel, Vogel 2012) with its own smoothed derivative as the velocity to
/// extrapolate: an exponential smoothing whose cut-off frequency rises with the speed.
///
///   dx <- smoothed (z - z_before) / dt at cut-off d
///   x  <- smoothed z at cut-off min + beta |dx|;  predict x + dx lead
///
/// The share of a new value at cut-off f is 1 / (1 + 1 / (2 pi f dt)), at the true dt. The rotation likewise,
/// its angular speed taken as that of a point kLever away. No allocation.
class OneEuro final : public Predictor {
public:
    struct Options {
        double least_cutoff_hz;       ///< min
        double beta_hz_s_per_m;       ///< beta
        double derivative_cutoff_hz;  ///< d
    };

    explicit OneEuro(const Options& options) : options_(options) {}

    [[nodiscard]] SampleStatus correct(const PoseSample& sample) noexcept override;
    [[nodiscard]] PosePrediction predict(double lead_s) const noexcept override;
    [[nodiscard]] double time_s() const noexcept override { return clock_.time_s(); }
    [[nodiscard]] std::optional<Motion> motion() const noexcept override { return steady_motion(smoothed_); }

private:
    [[nodiscard]] double share_at_speed(double speed_mps, double dt) const noexcept;

    SampleClock clock_;
    Options options_;
    PosePrediction smoothed_;
    Eigen::Vector3d last_position_ = Eigen::Vector3d::Zero();
    Eigen::Quaterniond last_orientation_ = Eigen::Quaterniond::Identity();
};

}  // namespace tracking
