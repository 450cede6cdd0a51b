#include "strikes/tip_rests.h"

#include <algorithm>
#include <cmath>

namespace app {
namespace {

constexpr double kTouchingM = 0.003, kStillM = 0.005;

}  // namespace

void TipRests::restart(std::uint32_t stick) {
    std::fill_n(rests_.begin() + static_cast<std::ptrdiff_t>(stick * hold_s_.size()), hold_s_.size(),
                std::nullopt);
}

void TipRests::struck(std::uint32_t instrument, double onset_s) {
    double& newest = struck_s_[instrument];
    newest = std::max(newest, onset_s);
}

void TipRests::sample(std::uint32_t stick, double s, const Eigen::Vector3d& tip,
                      std::span<const double> clearance_m) {
    for (std::uint32_t i = 0; i < hold_s_.size(); ++i) {
        if (hold_s_[i] == 0) continue;
        std::optional<Rest>& rest = rests_[stick * hold_s_.size() + i];
        if (clearance_m[i] > kTouchingM) {
            rest.reset();
            continue;
        }
        if (!rest || (tip - rest->place).norm() > kStillM) rest = {s, tip};
        if (s - rest->since_s < hold_s_[i] || !std::isfinite(struck_s_[i]) || struck_s_[i] > s) continue;
        struck_s_[i] = -std::numeric_limits<double>::infinity();
        found_.push_back({s, stick, i});
    }
}

}  // namespace app
