#include "sensors/live_intake.h"

#include <cmath>

#include "files/one_line.h"

namespace app {
namespace {

constexpr double kLongAgoS = 1e6;

}  // namespace

std::array<Eigen::Quaterniond, StickNames::kMostSticks> LiveIntake::identities() {
    std::array<Eigen::Quaterniond, StickNames::kMostSticks> all;
    all.fill(Eigen::Quaterniond::Identity());
    return all;
}

void LiveIntake::put(std::string_view stick, tracking::PoseSample sample, bool has_time,
                     std::int64_t read_ns) {
    const std::optional<std::size_t> index = names_.index_of(stick);
    if (!index) {
        ++faults_.foreign;
        return;
    }
    if (samples_.size() == kLongest) {
        ++faults_.lost;
        return;
    }
    if (sample.has_orientation)
        orientations_[*index] = sample.orientation;
    else
        sample.orientation = orientations_[*index];
    if (has_time) {
        if (!base_s_) base_s_ = std::abs(sample.t_s) > kLongAgoS ? std::floor(sample.t_s) : 0;
        sample.t_s -= *base_s_;
    }
    samples_.push_back({*index, sample, has_time, 0, 0, read_ns});
}

void LiveIntake::malformed(const std::string& what) {
    if (faults_.malformed++ == 0) faults_.first = one_line(what, 240);
}

std::optional<SourceSample> LiveIntake::take() {
    if (samples_.empty()) return std::nullopt;
    const SourceSample sample = samples_.front();
    samples_.pop_front();
    return sample;
}

}  // namespace app
