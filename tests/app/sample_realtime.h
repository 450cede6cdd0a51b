#pragma once
#include <sim/simulation.h>

#include <cmath>
#include <functional>

#include "kit/kit.h"
#include "latency/timings.h"
#include "play/play.h"

/// Made-up runs in real time whose figures are known in closed form.
namespace sample {

inline constexpr double kTipRadius = 0.006;

/// One drum of 20 cm, its head level at the height of 0.8 m.
inline app::Kit one_drum() {
    app::Kit kit;
    app::Instrument drum;
    drum.name = "snare";
    drum.kind = "drum";
    drum.body.shape = {{0.2, 0.1, 0.2}, 0.1, 1};
    drum.body.world_from_body.translation() = Eigen::Vector3d(0, 0.7, 0);
    drum.body.zones = {sim::Zone{}};
    kit.instruments.push_back(drum);
    return kit;
}

/// The height of the tip's centre on the drum's axis at which it touches.
inline double touch_height(const app::Kit& kit) {
    double low = 0.75, high = 1;
    for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (low + high);
        const Eigen::Vector3d point(0, middle, 0);
        (sim::rest_distance(kit.instruments[0].body, point, kTipRadius).distance > 0 ? high : low) = middle;
    }
    return high;
}

/// A height over time, with its rate.
struct Height {
    std::function<double(double)> at, rate;
};

/// What `fps` frames a second from `from_s` to `to_s` show of a stick over the drum's middle.
inline void draw(app::RealtimeResult& run, const Height& height, double from_s, double to_s, double fps = 30,
                 std::uint32_t stick = 0, std::uint64_t lap = 0) {
    for (int k = 0; from_s + k / fps < to_s; ++k) {
        app::DrawnTip tip;
        tip.frame = static_cast<std::uint64_t>(k);
        tip.stick = stick;
        tip.lap = lap;
        tip.t_s = from_s + k / fps;
        tip.tip = Eigen::Vector3d(0, height.at(tip.t_s), 0);
        tip.velocity = Eigen::Vector3d(0, height.rate(tip.t_s), 0);
        run.tips.push_back(tip);
    }
}

/// A stroke that falls at `speed` and is at `height_m` at `t_s`.
inline Height falling(double t_s, double height_m, double speed) {
    return {[=](double t) { return height_m - speed * (t - t_s); }, [=](double) { return -speed; }};
}

/// Strikes of the drum, released; notes of them in the output at these times of the lap's clock, which began
/// with the run. Times are whole samples.
inline void sound(app::PlayResult& play, app::RealtimeResult& run, const std::vector<double>& onsets_s,
                  std::uint32_t stick = 0, std::uint64_t lap = 0) {
    for (const double onset_s : onsets_s) {
        app::Strike strike;
        strike.id = play.strikes.size() + 1;
        strike.stick = stick;
        strike.outcome = app::Outcome::released;
        play.strikes.push_back(strike);
        app::NoteTiming note;
        note.strike = play.strikes.size() - 1;
        note.lap = lap;
        note.pose_age_s = 0.05;
        note.played.onset_sample = std::llround(
            (onset_s - play.t0_s + static_cast<double>(lap) * run.period_s) * audio::kSampleRate);
        run.notes.push_back(note);
    }
}

}  // namespace sample
