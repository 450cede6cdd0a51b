#pragma once
#include <tracking/trace.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <string>

#include "compare/recording.h"

/// Recordings whose truth is known in closed form.
namespace sample {

using Path = std::function<tracking::PoseSample(double)>;

/// Samples of a path at first_s, first_s + 1/rate, ... up to last_s (as near as the rate allows).
inline tracking::StickTrace stick_of(const Path& path, double last_s, double rate_hz = 1000,
                                     double first_s = 0) {
    tracking::StickTrace stick;
    stick.name = "right";
    const int count = static_cast<int>(std::lround((last_s - first_s) * rate_hz));
    for (int k = 0; k <= count; ++k) {
        const double t_s = first_s + k / rate_hz;
        stick.samples.push_back(path(t_s));
        stick.samples.back().t_s = t_s;
    }
    return stick;
}

inline app::Recording recording_of(const Path& path, double last_s, double rate_hz = 1000,
                                   const std::string& file = "sample.csv",
                                   const std::string& person = "someone") {
    tracking::Trace trace;
    trace.file = file;
    trace.sticks.push_back(stick_of(path, last_s, rate_hz));
    return app::recording_of(std::move(trace), person);
}

/// A sine of 100 mm and one period a second along x: never a low of the tip.
inline tracking::PoseSample sine(double t_s) {
    tracking::PoseSample pose;
    pose.position = {0.1 * std::sin(2 * std::numbers::pi * t_s), 1, 0};
    return pose;
}

/// 2 m/s along x, turning at 3 rad/s about z.
inline tracking::PoseSample steady(double t_s) {
    tracking::PoseSample pose;
    pose.position = {2 * t_s, 1, 0.5};
    pose.orientation = Eigen::AngleAxisd(3 * t_s, Eigen::Vector3d::UnitZ());
    pose.has_orientation = true;
    return pose;
}

/// Strokes: the height bounces between 1 and 1.2 m twice a second, lowest at 0.25, 0.75, ... s.
inline tracking::PoseSample strokes(double t_s) {
    tracking::PoseSample pose;
    pose.position = {0, 1 + 0.2 * std::abs(std::cos(2 * std::numbers::pi * t_s)), 0};
    return pose;
}

}  // namespace sample
