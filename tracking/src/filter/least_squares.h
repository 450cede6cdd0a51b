#pragma once
#include <Eigen/Core>

#include "filter/sample_clock.h"
#include "filter/sample_window.h"
#include "tracking/predictor.h"

namespace tracking {

/// A polynomial in time through the last samples by least squares, extrapolated; the rotation likewise, as
/// rotation vectors about the newest orientation. At the samples' true times; the window starts filled with
/// the first sample, at the first step's spacing. No allocation; O(n degree^2) a sample.
class LeastSquares final : public Predictor {
public:
    static constexpr int kMostDegree = 3;
    static constexpr std::size_t kMostSamples = 64;

    /// 0 <= degree <= kMostDegree, degree < samples <= kMostSamples.
    LeastSquares(int degree, std::size_t samples);

    [[nodiscard]] SampleStatus correct(const PoseSample& sample) noexcept override;
    [[nodiscard]] PosePrediction predict(double lead_s) const noexcept override;
    [[nodiscard]] double time_s() const noexcept override { return clock_.time_s(); }
    /// None for degree 3.
    [[nodiscard]] std::optional<Motion> motion() const noexcept override;

private:
    /// The stick stood still before its first sample: copies of it at earlier times, `dt` apart.
    void fill_before(double dt) noexcept;
    void fit() noexcept;

    int degree_;
    std::size_t samples_;
    bool started_ = false;  ///< there was a second sample
    SampleClock clock_;
    SampleWindow window_;
    double span_s_ = 1;                                       ///< the polynomial's unit of time
    Eigen::Matrix<double, kMostDegree + 1, 6> coefficients_;  ///< of position [m] and rotation vector [rad]
};

}  // namespace tracking
