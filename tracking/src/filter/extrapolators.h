#pragma once
#include "filter/sample_clock.h"
#include "filter/sample_window.h"
#include "tracking/predictor.h"

namespace tracking {

/// A pose and its rates, moved on at constant velocity and constant angular velocity.
struct ConstantRates {
    PosePrediction now;

    [[nodiscard]] PosePrediction after(double lead_s) const noexcept;
    /// Takes the step from the pose in `now` to `next`, dt later: rates are their difference over dt.
    void step_to(const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation, double dt) noexcept;
};

/// The newest sample, held still.
class Hold : public Predictor {
public:
    [[nodiscard]] SampleStatus correct(const PoseSample& sample) noexcept override;
    [[nodiscard]] PosePrediction predict(double lead_s) const noexcept override;
    [[nodiscard]] double time_s() const noexcept override { return clock_.time_s(); }
    [[nodiscard]] std::optional<Motion> motion() const noexcept override { return steady_motion(pose_); }

private:
    SampleClock clock_;
    PosePrediction pose_;
};

/// The newest sample, moved on by the difference of the last two over their time.
class Difference : public Predictor {
public:
    [[nodiscard]] SampleStatus correct(const PoseSample& sample) noexcept override;
    [[nodiscard]] PosePrediction predict(double lead_s) const noexcept override {
        return rates_.after(lead_s);
    }
    [[nodiscard]] double time_s() const noexcept override { return clock_.time_s(); }
    [[nodiscard]] std::optional<Motion> motion() const noexcept override { return steady_motion(rates_.now); }

private:
    SampleClock clock_;
    ConstantRates rates_;
};

/// The method that the thesis compares with (its introduction to chapter 3 and figure 3-3): a moving average
/// as the position, the difference of successive averages over the newest dt as the velocity. The average
/// lags by half the window. Rotations are averaged as rotation vectors about the newest one.
class MovingAverage : public Predictor {
public:
    /// A window by count starts filled with the first sample.
    explicit MovingAverage(const SampleWindow& window) : window_(window) {}

    [[nodiscard]] SampleStatus correct(const PoseSample& sample) noexcept override;
    [[nodiscard]] PosePrediction predict(double lead_s) const noexcept override {
        return rates_.after(lead_s);
    }
    [[nodiscard]] double time_s() const noexcept override { return clock_.time_s(); }
    [[nodiscard]] std::optional<Motion> motion() const noexcept override { return steady_motion(rates_.now); }

private:
    SampleClock clock_;
    SampleWindow window_;
    ConstantRates rates_;
};

}  // namespace tracking
