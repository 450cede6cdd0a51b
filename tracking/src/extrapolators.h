#pragma once
#include <vector>

#include "sample_clock.h"
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

private:
    SampleClock clock_;
    ConstantRates rates_;
};

/// The method that the thesis compares with (its introduction to chapter 3 and figure 3-3): a moving average
/// as the position, the difference of successive averages over the newest dt as the velocity. The average
/// lags by half the window. Rotations are averaged as rotation vectors about the newest one. At most
/// kCapacity samples are averaged.
class MovingAverage : public Predictor {
public:
    static constexpr std::size_t kCapacity = 256;

    /// The last `count` samples, the buffer filled with the first at the start; 1 <= count <= kCapacity.
    static std::unique_ptr<MovingAverage> of_count(std::size_t count);
    /// The samples of the last `window_s`: younger than that by more than 1 us.
    static std::unique_ptr<MovingAverage> of_window(double window_s);

    [[nodiscard]] SampleStatus correct(const PoseSample& sample) noexcept override;
    [[nodiscard]] PosePrediction predict(double lead_s) const noexcept override {
        return rates_.after(lead_s);
    }
    [[nodiscard]] double time_s() const noexcept override { return clock_.time_s(); }

private:
    MovingAverage(std::size_t count, double window_s);
    void restart(const PoseSample& sample) noexcept;
    void push(const PoseSample& sample) noexcept;
    [[nodiscard]] std::size_t in_window() const noexcept;
    /// The sample `age` samples before the newest.
    [[nodiscard]] const PoseSample& back(std::size_t age) const noexcept;

    SampleClock clock_;
    std::size_t count_;  // 0: by time
    double window_s_;
    std::vector<PoseSample> ring_;  // kCapacity long from the start
    std::size_t newest_ = 0;
    std::size_t held_ = 0;
    ConstantRates rates_;
};

}  // namespace tracking
