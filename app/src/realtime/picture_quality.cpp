#include "realtime/picture_quality.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

namespace app {
namespace {

constexpr std::size_t kRecentFrames = 90, kLateFrames = 3;
constexpr std::size_t kRecentBlocks = 200;
constexpr double kLateBlocks = 0.05;
constexpr double kShareOfFrame = 0.6;
constexpr double kLeastWaitS = 8, kLongestWaitS = 64;
constexpr double kSettleS = 0.25;
constexpr double kNewestWeight = 0.1;  // weight of the newest drawing time

}  // namespace

const std::vector<QualityLevel>& quality_levels() {
    static const std::vector<QualityLevel> levels = {
        {"4 samples per pixel, shadows", 4, 512, 1, 1},
        {"1 sample per pixel, shadows", 1, 512, 1, 1},
        {"1 sample per pixel, no shadows", 1, 0, 1, 1},
        {"half the size, no shadows", 1, 0, 2, 1},
        {"a quarter of the size, no shadows", 1, 0, 4, 1},
        {"a quarter of the size, half the rate", 1, 0, 4, 2},
        {"a quarter of the size, a quarter of the rate", 1, 0, 4, 4},
    };
    return levels;
}

QualityRule::QualityRule(double frame_s, std::vector<double> trial_s)
    : frame_s_(frame_s), trial_s_(std::move(trial_s)) {
    while (level_ + 1 < trial_s_.size() && !fits(level_)) ++level_;
}

bool QualityRule::fits(std::size_t level) const {
    return slowdown_ * trial_s_[level] < kShareOfFrame * frame_s_ * quality_levels()[level].rate_divisor;
}

bool QualityRule::wants(std::uint64_t index) const {
    return index % static_cast<std::uint64_t>(quality_levels()[level_].rate_divisor) == 0;
}

std::optional<std::string> QualityRule::lower(double at_s, const std::string& why) {
    quiet_since_s_ = lowered_at_s_ = at_s;
    late_.clear();
    blocks_.clear();
    if (level_ + 1 == trial_s_.size()) return std::nullopt;
    // A rise that did not last is not tried again so soon.
    wait_s_ = at_s - raised_at_s_ < kLongestWaitS ? std::min(2 * wait_s_, kLongestWaitS) : kLeastWaitS;
    ++level_;
    return fmt::format("{}: pictures go down to {}", why, quality_levels()[level_].name);
}

std::optional<std::string> QualityRule::frame(double at_s, bool in_time, double draw_s) {
    if (draw_s >= 0 && trial_s_[level_] > 0)
        slowdown_ += kNewestWeight * (draw_s / trial_s_[level_] - slowdown_);
    late_.push_back(!in_time);
    if (late_.size() > kRecentFrames) late_.pop_front();
    if (!in_time) {
        quiet_since_s_ = at_s;
        const auto late = std::count(late_.begin(), late_.end(), true);
        if (late >= static_cast<std::ptrdiff_t>(kLateFrames))
            return lower(at_s, fmt::format("{} of the last {} frames were late", late, late_.size()));
    }
    if (level_ == 0 || at_s - quiet_since_s_ < wait_s_ || !fits(level_ - 1)) return std::nullopt;
    --level_;
    raised_at_s_ = quiet_since_s_ = at_s;
    late_.clear();
    return fmt::format("nothing was late for {:.0f} s: pictures go up to {}", wait_s_,
                       quality_levels()[level_].name);
}

std::optional<std::string> QualityRule::outgrown(double at_s) {
    if (at_s - lowered_at_s_ < kSettleS || level_ + 1 == trial_s_.size() ||
        quality_levels()[level_ + 1].rate_divisor > quality_levels()[level_].rate_divisor)
        return std::nullopt;
    return lower(at_s, "the delay of pictures outgrew their lead");
}

std::optional<std::string> QualityRule::blocks(double at_s, std::size_t count, std::size_t late) {
    if (count == 0) return std::nullopt;
    blocks_.emplace_back(count, late);
    std::size_t total = 0, bad = 0;
    for (const auto& [n, l] : blocks_) total += n, bad += l;
    while (total - blocks_.front().first >= kRecentBlocks) {
        total -= blocks_.front().first, bad -= blocks_.front().second;
        blocks_.pop_front();
    }
    if (total < kRecentBlocks || static_cast<double>(bad) < kLateBlocks * static_cast<double>(total))
        return std::nullopt;
    return lower(at_s, fmt::format("{} of {} blocks of sound were late", bad, total));
}

}  // namespace app
