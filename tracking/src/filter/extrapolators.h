#pragma once
#include "filter/sample_clock.h"
#include "filter/sample_window.h"
#include "tracking/predictor.h"

namespace tracking {

/// The newest sample, held still.
class Hold final : public Predictor {
public:
    [[nodiscard]] SampleStatus correct(const PoseSample& sample) noexcept override;
    [[nodiscard]] PosePrediction predict(double lead_s) const noexcept override;
    [[nodiscard]] double time_s() const noexcept override { return clock_.time_s(); }
    [[nodiscard]] std::optional<Motion> motion() const noexcept override { return steady_motion(pose_); }

private:
    SampleClock clock_;
    PosePrediction pose_;
};

/// Predictors that go on from a pose at constant velocity and constant angular velocity; correct() finds
/// these.
class ConstantRates : public Predictor {
public:
    [[nodiscard]] PosePrediction predict(double lead_s) const noexcept final;
    [[nodiscard]] double time_s() const noexcept final { return clock_.time_s(); }
    [[nodiscard]] std::optional<Motion> motion() const noexcept final { return steady_motion(now_); }

protected:
    /// At rest at the sample's pose.
    void start(const PoseSample& sample) noexcept;
    /// Goes to a pose that is dt after the last one; the velocities are the difference of both over dt.
    void step_to(const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation, double dt) noexcept;

    SampleClock clock_;
    PosePrediction now_;
};

/// The newest sample, moved on by the difference of the last two over their time.
class Difference final : public ConstantRates {
public:
    [[nodiscard]] SampleStatus correct(const PoseSample& sample) noexcept override;
};

/// The method that the thesis compares with (its introduction to chapter 3 and figure 3-3): a moving average
/// as the position, the difference of successive averages over the newest dt as the velocity. The average
/// lags by half the window. Rotations are averaged as rotation vectors about the newest one.
class MovingAverage final : public ConstantRates {
public:
    /// A window by count starts filled with the first sample.
    explicit MovingAverage(const SampleWindow& window) : window_(window) {}

    [[nodiscard]] SampleStatus correct(const PoseSample& sample) noexcept override;

private:
    SampleWindow window_;
};

}  // namespace tracking
