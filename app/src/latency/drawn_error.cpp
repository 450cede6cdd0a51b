#include "latency/drawn_error.h"

#include <tracking/predictor.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "kit/tip_track.h"
#include "process/clock.h"

namespace app {
namespace {

std::uint64_t lap_at(double at_s, double period_s) {
    return period_s > 0 ? static_cast<std::uint64_t>(std::max(0.0, std::floor(at_s / period_s))) : 0;
}

std::optional<Eigen::Vector3d> truth_at(const TipTrack& track, double t_s) {
    const auto after = std::upper_bound(track.t_s.begin(), track.t_s.end(), t_s);
    if (after == track.t_s.begin() || after == track.t_s.end()) return std::nullopt;
    const auto b = static_cast<std::size_t>(after - track.t_s.begin()), a = b - 1;
    const double dt = track.t_s[b] - track.t_s[a];
    if (dt > tracking::kGapS) return std::nullopt;
    return track.tip[a] + (t_s - track.t_s[a]) / dt * (track.tip[b] - track.tip[a]);
}

}  // namespace

std::vector<DrawnError> drawn_errors(const RealtimeResult& realtime, std::span<const TipTrack> tracks,
                                     double t0_s) {
    std::vector<DrawnError> errors;
    std::vector<const DrawnTip*> screen(tracks.size(), nullptr);
    auto tip = realtime.tips.begin();
    for (const FrameTiming& frame : realtime.frames) {
        for (; tip != realtime.tips.end() && tip->frame <= frame.index; ++tip)
            if (tip->shown && tip->stick < screen.size()) screen[tip->stick] = &*tip;
        if (!frame.asked_for) continue;
        const double at_s = to_s(frame.shown_ns);
        const std::uint64_t lap = lap_at(at_s, realtime.period_s);
        for (std::uint32_t stick = 0; stick < screen.size(); ++stick) {
            if (screen[stick] == nullptr || screen[stick]->lap != lap) continue;
            if (const auto truth = truth_at(tracks[stick], t0_s + at_s))
                errors.push_back({at_s, stick, (screen[stick]->drawn - *truth).norm()});
        }
    }
    return errors;
}

double rms_mm(std::span<const DrawnError> errors, double from_s, double to_s) {
    const auto before = [](const DrawnError& error, double t_s) { return error.at_s < t_s; };
    const auto begin = std::lower_bound(errors.begin(), errors.end(), from_s, before),
               end = std::lower_bound(begin, errors.end(), to_s, before);
    double sum = 0;
    for (auto error = begin; error != end; ++error) sum += error->error_m * error->error_m;
    return begin == end ? 0 : 1e3 * std::sqrt(sum / static_cast<double>(end - begin));
}

}  // namespace app
