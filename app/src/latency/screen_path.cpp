#include "latency/screen_path.h"

#include <sim/hermite_piece.h>
#include <sim/modal_body.h>
#include <tracking/predictor.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "kit/surface_entry.h"

namespace app {
namespace {

constexpr double kLongestPieceS = 0.25, kTouchToleranceS = 1e-11;

/// The tips of one stick that were shown during one lap, by time.
using DrawnPath = std::vector<DrawnTip>;

std::map<std::pair<std::uint32_t, std::uint64_t>, DrawnPath> drawn_paths(const RealtimeResult& realtime) {
    std::map<std::pair<std::uint32_t, std::uint64_t>, DrawnPath> paths;  // by stick and lap
    for (const DrawnTip& tip : realtime.tips) {
        DrawnPath& path = paths[{tip.stick, tip.lap}];
        if (tip.shown && (path.empty() || tip.t_s > path.back().t_s)) path.push_back(tip);
    }
    return paths;
}

/// When the path comes into the surface, `distance` 0 or less, next to a note's onset.
template <class Distance>
std::optional<double> nearest_touch(const DrawnPath& path, double onset_s, const Distance& distance) {
    const double from_s = onset_s - kPictureWindowS, to_s = onset_s + kPictureWindowS;
    std::optional<double> nearest;
    auto b = std::ranges::lower_bound(path, from_s, {}, &DrawnTip::t_s);
    if (b == path.begin() && b != path.end()) ++b;
    for (; b != path.end() && (b - 1)->t_s <= to_s; ++b) {
        const DrawnTip& a = *(b - 1);
        if (b->t_s - a.t_s > kLongestPieceS) continue;
        const sim::HermitePiece piece({a.t_s, a.tip, a.velocity}, {b->t_s, b->tip, b->velocity});
        const auto distance_at = [&](double t_s) { return distance(piece.position(t_s)); };
        walk(a.t_s, b->t_s, distance(a.tip), piece.greatest_speed(), distance_at, [&](const WalkStep& step) {
            if (!step.enters()) return;
            const double t_s = entry_between(step.from, step.to, kTouchToleranceS, distance_at);
            const bool nearer = !nearest || std::abs(t_s - onset_s) < std::abs(*nearest - onset_s);
            if (nearer && t_s >= from_s && t_s <= to_s) nearest = t_s;
        });
    }
    return nearest;
}

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

double onset_in_lap_s(const NoteTiming& note, double t0_s, double period_s) {
    return t0_s + static_cast<double>(note.played.onset_sample) / audio::kSampleRate -
           static_cast<double>(note.lap) * period_s;
}

std::vector<SoundPicture> sound_and_picture(const PlayResult& play, const RealtimeResult& realtime,
                                            const Kit& kit, double tip_radius_m) {
    auto paths = drawn_paths(realtime);
    std::vector<SoundPicture> matched;
    for (std::size_t i = 0; i < realtime.notes.size(); ++i) {
        const NoteTiming& note = realtime.notes[i];
        const Strike& strike = play.strikes[note.strike];
        const DrawnPath& path = paths[{strike.stick, note.lap}];
        const auto distance = [&](const Eigen::Vector3d& tip) {
            return sim::rest_distance(kit.instruments[strike.instrument].body, tip, tip_radius_m).distance;
        };
        const double onset_s = onset_in_lap_s(note, play.t0_s, realtime.period_s);
        const std::optional<double> touch_s = nearest_touch(path, onset_s, distance);
        if (!touch_s) continue;
        matched.push_back({i, onset_s, *touch_s, std::nullopt});
        const auto behind =
            std::find_if(std::ranges::lower_bound(path, *touch_s, {}, &DrawnTip::t_s), path.end(),
                         [&](const DrawnTip& tip) { return tip.held || distance(tip.tip) <= 0; });
        if (behind != path.end() && behind->t_s <= *touch_s + kPictureWindowS)
            matched.back().frame_s = behind->t_s;
    }
    return matched;
}

std::vector<DrawnError> drawn_errors(const RealtimeResult& realtime, std::span<const TipTrack> tracks,
                                     double t0_s) {
    std::vector<DrawnError> errors;
    std::vector<const DrawnTip*> screen(tracks.size(), nullptr);
    auto tip = realtime.tips.begin();
    for (const FrameTiming& frame : realtime.frames) {
        for (; tip != realtime.tips.end() && tip->frame <= frame.index; ++tip)
            if (tip->shown && tip->stick < screen.size()) screen[tip->stick] = &*tip;
        if (!frame.asked_for) continue;
        const double at_s = 1e-9 * static_cast<double>(frame.shown_ns);
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
    const auto begin = std::ranges::lower_bound(errors, from_s, {}, &DrawnError::at_s),
               end = std::ranges::lower_bound(errors, to_s, {}, &DrawnError::at_s);
    double sum = 0;
    for (auto error = begin; error < end; ++error) sum += error->error_m * error->error_m;
    return begin < end ? 1e3 * std::sqrt(sum / static_cast<double>(end - begin)) : 0;
}

}  // namespace app
