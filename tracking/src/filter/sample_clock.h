#pragma once
#include <cmath>

#include "tracking/predictor.h"

namespace tracking {

/// Judges a new sample before an estimator uses its values: newer, after a gap, or not usable.
class SampleClock {
public:
    /// accepted, not_newer, not_finite (also a quaternion whose norm is not near 1), or reinitialised: the
    /// first sample, or one more than kGapS after the newest. Leaves the clock alone.
    [[nodiscard]] SampleStatus judge(const PoseSample& sample) const noexcept {
        if (!is_finite(sample)) return SampleStatus::not_finite;
        if (!started_) return SampleStatus::reinitialised;
        if (!(sample.t_s > t_s_)) return SampleStatus::not_newer;
        return sample.t_s - t_s_ > kGapS ? SampleStatus::reinitialised : SampleStatus::accepted;
    }
    /// Judges a sample and calls `update(sample)` for an accepted one, `start(sample)` for one that starts
    /// the estimator anew. Returns their answer, or the judgement for samples that are refused.
    template <class Start, class Update>
    [[nodiscard]] SampleStatus take(const PoseSample& sample, const Start& start,
                                    const Update& update) const noexcept {
        const SampleStatus status = judge(sample);
        if (status == SampleStatus::accepted) return update(sample);
        return status == SampleStatus::reinitialised ? start(sample) : status;
    }
    /// The sample has been taken.
    void advance(double t_s) noexcept {
        started_ = true;
        t_s_ = t_s;
    }

    [[nodiscard]] double time_s() const noexcept { return t_s_; }

private:
    /// A sum is finite only if its terms are (and do not exceed 1e307).
    [[nodiscard]] static bool is_finite(const PoseSample& sample) noexcept {
        if (!std::isfinite(sample.t_s + sample.position.sum())) return false;
        return !sample.has_orientation || std::abs(sample.orientation.squaredNorm() - 1) < 0.1;
    }

    bool started_ = false;
    double t_s_ = 0;
};

}  // namespace tracking
