#pragma once
#include <vector>

#include "tracking/trace.h"

namespace tracking {

/// The newest samples of a stick, by count or by time; at most kCapacity. Allocates when it is made only.
class SampleWindow {
public:
    static constexpr std::size_t kCapacity = 256;

    /// The last `count` samples, 1 <= count <= kCapacity.
    static SampleWindow of_count(std::size_t count);
    /// The samples of the last `window_s`: younger than that by more than 1 us.
    static SampleWindow of_time(double window_s);

    void clear() noexcept { held_ = 0; }
    /// A sample without orientation gets the newest known one (the identity before any).
    void push(const PoseSample& sample) noexcept;
    /// Fills a window by count with copies of one sample.
    void fill(const PoseSample& sample) noexcept;

    /// How many samples are in the window.
    [[nodiscard]] std::size_t size() const noexcept;
    /// The sample `age` samples before the newest.
    [[nodiscard]] const PoseSample& back(std::size_t age) const noexcept {
        return ring_[(newest_ + kCapacity - age) % kCapacity];
    }

private:
    SampleWindow(std::size_t count, double window_s);

    std::size_t count_;  // 0: by time
    double window_s_;
    std::vector<PoseSample> ring_;  // kCapacity long from the start
    std::size_t newest_ = 0;
    std::size_t held_ = 0;
};

}  // namespace tracking
