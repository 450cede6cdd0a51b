#include "filter/sample_window.h"

#include <algorithm>

namespace tracking {

SampleWindow::SampleWindow(std::size_t count, double window_s)
    : count_(count), window_s_(window_s), ring_(kCapacity) {}

SampleWindow SampleWindow::of_count(std::size_t count) {
    return {count, 0};
}

SampleWindow SampleWindow::of_time(double window_s) {
    return {0, window_s};
}

void SampleWindow::push(const PoseSample& sample) noexcept {
    const Eigen::Quaterniond known = held_ > 0 ? back(0).orientation : Eigen::Quaterniond::Identity();
    newest_ = (newest_ + 1) % kCapacity;
    ring_[newest_] = sample;
    ring_[newest_].orientation = sample.has_orientation ? sample.orientation.normalized() : known;
    held_ = std::min(held_ + 1, kCapacity);
}

void SampleWindow::fill(const PoseSample& sample) noexcept {
    clear();
    for (std::size_t i = 0; i < std::max<std::size_t>(count_, 1); ++i) push(sample);
}

std::size_t SampleWindow::size() const noexcept {
    if (count_ > 0) return std::min(count_, held_);
    constexpr double kSlack = 1e-6;
    std::size_t n = 1;
    while (n < held_ && back(0).t_s - back(n).t_s < window_s_ - kSlack) ++n;
    return n;
}

}  // namespace tracking
