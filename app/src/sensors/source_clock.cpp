#include "sensors/source_clock.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "statistics/statistics.h"

namespace app {
namespace {

constexpr double kBucketS = 0.1;
constexpr double kSettlingRate = 0.5, kSlewRate = 200e-6;
constexpr int kStraysInARow = 3;
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

std::optional<double> ahead_of_wall(double reading_s) noexcept {
    constexpr double kFrom1900S = 2208988800.0, kYearS = 366 * 86400.0;
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    const double ahead_s = reading_s - std::chrono::duration<double>(now).count();
    for (const double ahead : {ahead_s, ahead_s - kFrom1900S})
        if (std::abs(ahead) < kYearS) return ahead;
    return std::nullopt;
}

std::optional<double> SourceClock::map(double source_s, double arrival_s) noexcept {
    const double delay = arrival_s - source_s;
    if (!started_) {
        begin(source_s, arrival_s);
    } else {
        const Fit found = fit(source_s, arrival_s);
        if (strays_for_long(found, source_s) || (found == Fit::in_order && stays_late(delay, arrival_s)))
            jump(source_s, arrival_s);
        else if (found == Fit::behind)
            return source_s + offset_s_;  // late: so is its mapped time
        else if (found == Fit::ahead)
            return std::nullopt;
    }
    take(delay, arrival_s);
    steer(source_s);
    latest_mapped_s_ = std::max(latest_mapped_s_, source_s + offset_s_);
    return source_s + offset_s_;
}

SourceClock::Fit SourceClock::fit(double source_s, double arrival_s) const noexcept {
    if (source_s <= newest_s_) return Fit::behind;
    return source_s + offset_s_ > arrival_s + kJumpS ? Fit::ahead : Fit::in_order;
}

/// A repeated sample is none of a clock that jumped.
bool SourceClock::strays_for_long(Fit fit, double source_s) noexcept {
    if (fit == Fit::behind && source_s == newest_s_) return false;
    const bool goes_on = fit == stray_ && source_s > stray_s_;
    stray_ = fit;
    stray_s_ = source_s;
    strays_ = fit == Fit::in_order ? 0 : goes_on ? strays_ + 1 : 1;
    return strays_ == kStraysInARow;
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
    strays_ = 0;
}

void SourceClock::jump(double source_s, double arrival_s) noexcept {
    const double old_offset_s = offset_s_;
    window_.fill({});
    seconds_.fill({});
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
