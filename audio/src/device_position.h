#pragma once
#include <cmath>
#include <cstdint>

namespace audio {

/// Which sample a device plays next, so that what it plays stays at its due time though the device's clock
/// drifts against ours. The difference is smoothed over 64 cycles; beyond 12 samples (0.25 ms) one sample a
/// cycle is dropped or repeated. At a start, after a gap of the device's, or 480 samples off, it jumps.
class DevicePosition {
public:
    /// First sample of a cycle of so many frames; `due` is the sample that is due when it begins.
    /// `continuous`: the cycle follows the last one without a gap.
    [[nodiscard]] std::int64_t begin_cycle(double due, int frames, bool continuous) noexcept {
        const double error = due - static_cast<double>(next_);
        if (!continuous || std::abs(error) > kJump) {
            next_ = std::llround(due);
            smoothed_ = 0;
        } else {
            follow(error);
        }
        const std::int64_t first = next_;
        next_ += frames;
        return first;
    }

    [[nodiscard]] std::uint64_t corrections() const noexcept { return corrections_; }

private:
    static constexpr double kJump = 480, kTolerance = 12, kCycles = 64;

    void follow(double error) noexcept {
        smoothed_ += (error - smoothed_) / kCycles;
        if (std::abs(smoothed_) <= kTolerance) return;
        const int step = smoothed_ > 0 ? 1 : -1;
        next_ += step;
        smoothed_ -= step;
        ++corrections_;
    }

    std::int64_t next_ = 0;
    double smoothed_ = 0;
    std::uint64_t corrections_ = 0;
};

}  // namespace audio
