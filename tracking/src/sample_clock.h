#pragma once
#include "tracking/predictor.h"

namespace tracking {

/// Decides what a new sample is to an estimator, before its values are used.
class SampleClock {
public:
    /// accepted, not_newer, not_finite (also a quaternion whose norm is not near 1), or reinitialised: the
    /// first sample, or one more than kGapS after the newest. Leaves the clock alone.
    [[nodiscard]] SampleStatus judge(const PoseSample& sample) const noexcept;
    /// The sample has been taken.
    void advance(double t_s) noexcept;

    [[nodiscard]] double time_s() const noexcept { return t_s_; }

private:
    bool started_ = false;
    double t_s_ = 0;
};

}  // namespace tracking
