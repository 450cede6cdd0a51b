#include "sensors/live_source.h"

#include <cmath>

#include "files/one_line.h"

namespace app {

LiveSource::LiveSource(const std::vector<std::string>& sticks) : names_(sticks) {
    orientations_.fill(Eigen::Quaterniond::Identity());
}

SourceStatus LiveSource::next(SourceSample& sample, std::int64_t deadline_ns) {
    if (samples_.empty() && !ended_) receive(deadline_ns);
    if (samples_.empty()) return ended_ ? SourceStatus::ended : SourceStatus::waiting;
    sample = samples_.front();
    samples_.pop_front();
    return SourceStatus::sample;
}

SourceHead LiveSource::head() const {
    SourceHead head;
    head.base_s = base_s_.value_or(0);
    return head;
}

void LiveSource::put(std::string_view stick, tracking::PoseSample sample, bool has_time) {
    constexpr double kLongAgoS = 1e6;
    const std::optional<std::size_t> index = names_.index_of(stick);
    if (!index || samples_.size() == kLongest) {
        ++(index ? faults_.lost : faults_.foreign);
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
    samples_.push_back({*index, sample, has_time, 0, 0, read_ns_});
}

void LiveSource::malformed(const std::string& what) {
    if (faults_.malformed++ == 0) faults_.first = one_line(what, 240);
}

}  // namespace app
