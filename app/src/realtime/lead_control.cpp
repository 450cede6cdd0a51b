#include "realtime/lead_control.h"

#include <algorithm>
#include <cmath>

namespace app {
namespace {

constexpr double kWindowS = 2, kPercentile = 0.98;
constexpr double kUpS = 0.0015, kDownS = 0.0005;
constexpr std::size_t kNewest = 5;
constexpr double kLongestLeadS = 0.15;  // poses are predicted no further

double percentile(std::vector<double> values, double share) {
    const auto nth =
        values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1) + 0.5);
    std::nth_element(values.begin(), nth, values.end());
    return *nth;
}

}  // namespace

LeadControl::LeadControl(double least_s, double rate_hz, double reserve_s)
    : least_s_(least_s),
      reserve_s_(reserve_s),
      window_(std::max<std::size_t>(kNewest, static_cast<std::size_t>(std::lround(kWindowS * rate_hz)))),
      lead_s_(least_s) {}

double LeadControl::measured(double delay_s) {
    if (recent_.size() < window_)
        recent_.push_back(delay_s);
    else
        recent_[next_ % window_] = delay_s;
    ++next_;
    delay_s_ = percentile(recent_, kPercentile);
    std::vector<double> newest;
    for (std::size_t i = 0; i < std::min(kNewest, recent_.size()); ++i)
        newest.push_back(recent_[(next_ - 1 - i) % window_]);
    // One late frame among many is no reason: only the percentile or a delay that stays.
    const double wanted = std::clamp(std::max(delay_s_, percentile(newest, 0.5)) + reserve_s_, least_s_,
                                     std::max(least_s_, kLongestLeadS));
    lead_s_ = std::clamp(wanted, lead_s_ - kDownS, lead_s_ + kUpS);
    return lead_s_;
}

}  // namespace app
