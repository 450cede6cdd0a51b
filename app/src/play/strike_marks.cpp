#include "play/strike_marks.h"

#include <algorithm>

namespace app {
namespace {

/// No strike is pending for longer.
constexpr double kLongestPendingS = 1.5;

}  // namespace

std::vector<StrikeMark> strike_marks(std::span<const Strike> strikes, double T) {
    std::vector<StrikeMark> marks;
    for (auto strike = strikes.rbegin();
         strike != strikes.rend() && strike->scheduled_at_s > T - kMarkS - kLongestPendingS; ++strike) {
        if (strike->outcome == Outcome::pending) continue;
        const bool cancelled = strike->outcome == Outcome::cancelled;
        const double from = cancelled ? strike->decided_at_s : strike->onset_s;
        if (T < from || T >= from + kMarkS) continue;
        const bool late = strike->onset_s - strike->contact_s > kLateMarkS;
        marks.push_back({cancelled ? MarkKind::cancelled
                         : late    ? MarkKind::late
                                   : MarkKind::released,
                         strike->point_world, strike->normal_world});
    }
    return marks;
}

std::optional<tracking::PosePrediction> recorded_pose(const tracking::StickTrace& stick, double T) {
    const auto next = std::ranges::lower_bound(stick.samples, T, {}, &tracking::PoseSample::t_s);
    if (next == stick.samples.end() || (next == stick.samples.begin() && next->t_s > T)) return std::nullopt;
    tracking::PosePrediction pose;
    pose.position = next->position, pose.orientation = next->orientation;
    if (next == stick.samples.begin()) return pose;
    const tracking::PoseSample& before = *(next - 1);
    const double share = (T - before.t_s) / (next->t_s - before.t_s);
    pose.position = before.position + share * (next->position - before.position);
    pose.orientation = before.orientation.slerp(share, next->orientation);
    return pose;
}

}  // namespace app
