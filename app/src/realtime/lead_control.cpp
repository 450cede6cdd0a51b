#include "realtime/lead_control.h"

#include <algorithm>
#include <cmath>

#include "statistics/statistics.h"

namespace app {
namespace {

constexpr double kWindowS = 2, kFollowed = 0.98;
constexpr double kUpS = 0.0015, kDownS = 0.0005;
constexpr std::size_t kNewest = 5;
constexpr double kLongestLeadS = 0.15;  // poses are predicted no further

}  // namespace

LeadControl::LeadControl(double least_s, double rate_hz, double reserve_s)
    : least_s_(least_s),
      reserve_s_(reserve_s),
      window_(std::max<std::size_t>(kNewest, static_cast<std::size_t>(std::lround(kWindowS * rate_hz)))),
      lead_s_(least_s) {}

double LeadControl::measured(double delay_s) {
    recent_.push_back(delay_s);
    if (recent_.size() > window_) recent_.pop_front();
    delay_s_ = quantile({recent_.begin(), recent_.end()}, kFollowed);
    const auto count = static_cast<std::ptrdiff_t>(std::min(kNewest, recent_.size()));
    const std::vector<double> newest(recent_.end() - count, recent_.end());
    // One late frame among many is no reason: only the percentile or a delay that stays.
    const double wanted = std::clamp(std::max(delay_s_, median(newest)) + reserve_s_, least_s_,
                                     std::max(least_s_, kLongestLeadS));
    lead_s_ = std::clamp(wanted, lead_s_ - kDownS, lead_s_ + kUpS);
    return lead_s_;
}

}  // namespace app
