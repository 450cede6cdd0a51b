#include "sample_clock.h"

#include <cmath>

namespace tracking {
namespace {

bool is_finite(const PoseSample& sample) {
    if (!std::isfinite(sample.t_s) || !sample.position.allFinite()) return false;
    return !sample.has_orientation || std::abs(sample.orientation.squaredNorm() - 1) < 0.1;
}

}  // namespace

SampleStatus SampleClock::judge(const PoseSample& sample) const noexcept {
    if (!is_finite(sample)) return SampleStatus::not_finite;
    if (!started_) return SampleStatus::reinitialised;
    if (!(sample.t_s > t_s_)) return SampleStatus::not_newer;
    return sample.t_s - t_s_ > kGapS ? SampleStatus::reinitialised : SampleStatus::accepted;
}

void SampleClock::advance(double t_s) noexcept {
    started_ = true;
    t_s_ = t_s;
}

}  // namespace tracking
