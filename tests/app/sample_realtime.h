#pragma once
#include <sim/simulation.h>

#include <cmath>
#include <functional>

#include "kit.h"
#include "play_result.h"
#include "realtime_result.h"
#include "tip_track.h"

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

inline app::Strike strike_at(double onset_s, std::uint32_t stick = 0) {
    app::Strike strike;
    strike.id = 1;
    strike.stick = stick;
    strike.outcome = app::Outcome::released;
    strike.onset_s = onset_s;
    return strike;
}

/// Notes of the strikes, in order, all in one lap.
inline void sound(app::RealtimeResult& run, std::size_t strikes, std::uint64_t lap = 0, double late_s = 0) {
    for (std::size_t i = 0; i < strikes; ++i) {
        app::NoteTiming note;
        note.strike = i;
        note.lap = lap;
        note.late_s = late_s;
        note.pose_age_s = 0.05;
        run.notes.push_back(note);
    }
}

}  // namespace sample
