#include "sensors/source_clock.h"

#include <algorithm>
#include <cmath>

#include "statistics/statistics.h"

namespace app {
namespace {

constexpr double kBucketS = 0.1;
constexpr double kSettlingRate = 0.5, kSlewRate = 200e-6;
constexpr int kBehindInARow = 3;
constexpr double kLateForS = 0.5;
constexpr std::int64_t kFewestSeconds = 5;  // that a drift is estimated from
constexpr double kLeastStepS = 1e-6;

}  // namespace

const char* name_of(SampleClock clock) {
    static constexpr std::array<const char*, 3> kNames = {"the trace's own, replayed", "the source's",
                                                          "arrival"};
    static_assert(kNames.size() == static_cast<std::size_t>(SampleClock::arrival) + 1);
    return kNames[static_cast<std::size_t>(clock)];
}

double DelayPercentile::p95() const noexcept {
    std::array<double, 1024> values = values_;
    return quantile_in_place(std::span(values).first(std::min(count_, values.size())), 0.95);
}

double SourceClock::map(std::size_t stick, double source_s, double arrival_s) noexcept {
    Stick& own = sticks_[stick];
    const double delay = arrival_s - source_s;
    if (!started_)
        begin(source_s, arrival_s);
    else if (jumped(own, source_s, arrival_s))
        jump(source_s, arrival_s);
    if (own.started && source_s <= own.newest) return source_s + offset_s_;  // late: so is its mapped time
    own = {source_s, source_s, 0, true};
    take(delay, arrival_s);
    steer(source_s);
    latest_mapped_s_ = std::max(latest_mapped_s_, source_s + offset_s_);
    return source_s + offset_s_;
}

bool SourceClock::jumped(Stick& stick, double source_s, double arrival_s) noexcept {
    const double delay = arrival_s - source_s;
    if (!stick.started) return false;
    if (source_s < stick.newest) {
        stick.behind = source_s > stick.previous || stick.behind == 0 ? stick.behind + 1 : 1;
        stick.previous = source_s;
        return stick.behind == kBehindInARow;
    }
    if (source_s - stick.newest > kJumpS && delay < target(arrival_s) - kJumpS) return true;
    return stays_late(delay, arrival_s);
}

bool SourceClock::stays_late(double delay, double arrival_s) noexcept {
    if (delay <= target_s_ + kJumpS) {
        late_since_s_ = -1;
        return false;
    }
    if (late_since_s_ < 0) late_since_s_ = arrival_s;
    return arrival_s - late_since_s_ > kLateForS;
}

void SourceClock::begin(double source_s, double arrival_s) noexcept {
    started_ = true;
    offset_s_ = target_s_ = arrival_s - source_s;
    begun_s_ = newest_s_ = source_s;
    late_since_s_ = -1;
}

void SourceClock::jump(double source_s, double arrival_s) noexcept {
    const double old_offset_s = offset_s_;
    window_.fill({});
    seconds_.fill({});
    sticks_.fill({});
    delays_.clear();
    begin(source_s, arrival_s);
    offset_s_ = std::max(offset_s_, latest_mapped_s_ + kLeastStepS - source_s);
    ++jumps_;
    last_jump_s_ = old_offset_s - offset_s_;
    shift_s_ -= last_jump_s_;
}

void SourceClock::take(double delay, double arrival_s) noexcept {
    const auto add = [delay](auto& buckets, double position) {
        const auto index = static_cast<std::int64_t>(std::floor(position));
        const auto count = static_cast<std::int64_t>(buckets.size());
        Bucket& bucket = buckets[static_cast<std::size_t>((index % count + count) % count)];
        bucket = {index, bucket.index == index ? std::min(bucket.least, delay) : delay};
    };
    add(window_, arrival_s / kBucketS);
    add(seconds_, arrival_s);
    target_s_ = target(arrival_s);
    delays_.add(delay - target_s_);
}

void SourceClock::steer(double source_s) noexcept {
    const double passed_s = std::max(0.0, source_s - newest_s_);
    newest_s_ = std::max(newest_s_, source_s);
    const double rate = source_s - begun_s_ < kSettlingS ? kSettlingRate : kSlewRate;
    offset_s_ += std::clamp(target_s_ - offset_s_, -rate * passed_s, rate * passed_s);
}

double SourceClock::target(double arrival_s) const noexcept {
    const auto oldest = static_cast<std::int64_t>(std::floor(arrival_s / kBucketS)) -
                        static_cast<std::int64_t>(window_.size()) + 1;
    double least = HUGE_VAL;
    for (const Bucket& bucket : window_)
        if (bucket.index >= oldest) least = std::min(least, bucket.least);
    return least < HUGE_VAL ? least : target_s_;
}

double SourceClock::drift_ppm() const noexcept {
    std::int64_t newest = kNever;
    for (const Bucket& bucket : seconds_) newest = std::max(newest, bucket.index);
    double n = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (const Bucket& bucket : seconds_) {
        if (bucket.index == kNever) continue;
        const std::int64_t age = newest - bucket.index;
        if (age == 0 || age >= static_cast<std::int64_t>(seconds_.size())) continue;
        const double at = -static_cast<double>(age), value = bucket.least - target_s_;
        n += 1, x += at, y += value, xx += at * at, xy += at * value;
    }
    if (n < kFewestSeconds) return 0;
    return -1e6 * (n * xy - x * y) / (n * xx - x * x);
}

ClockEstimate SourceClock::estimate() const noexcept {
    return {target_s_, drift_ppm(), delays_.p95(), jumps_, last_jump_s_};
}

}  // namespace app
