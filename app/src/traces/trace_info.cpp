#include "traces/trace_info.h"

#include <fmt/format.h>
#include <tracking/plausibility.h>
#include <tracking/predictor.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <vector>

#include "files/bad_input.h"
#include "kit/kit.h"
#include "report/json_document.h"
#include "statistics/statistics.h"
#include "strikes/stroke_lows.h"

namespace app {
namespace {

constexpr double kFlip = 1.5707963267948966;  // rad between two samples

/// What one stick of a trace is like. Times in s on the trace's clock, lengths in m; speeds are the tip's,
/// between samples.
struct StickInfo {
    std::string name;
    std::size_t samples = 0;
    double t0_s = 0, t_end_s = 0;
    double rate_hz = 0;                                  ///< 1 / median dt
    double dt_min_s = 0, dt_median_s = 0, dt_max_s = 0;  ///< between samples
    int gaps = 0;                                        ///< dt above tracking::kGapS
    Eigen::Vector3d low = Eigen::Vector3d::Zero(),
                    high = Eigen::Vector3d::Zero();  ///< extents of the tip's path
    double speed_median_mps = 0, speed_p95_mps = 0, speed_max_mps = 0;
    bool orientation = false;  ///< every sample has one
    int flips = 0;             ///< turns by more than 90 degrees between samples: faults of a tracker, mostly
    double first_flip_s = 0;
    int strokes = 0;  ///< height minima of the tip, prominence 25 mm
};

StickInfo info_of(const tracking::StickTrace& stick, const TipTrack& track) {
    StickInfo info;
    info.name = stick.name;
    info.samples = stick.samples.size();
    info.t0_s = track.t_s.front();
    info.t_end_s = track.t_s.back();
    std::vector<double> dt, speed;
    info.low = info.high = track.tip.front();
    for (std::size_t i = 1; i < track.t_s.size(); ++i) {
        dt.push_back(track.t_s[i] - track.t_s[i - 1]);
        speed.push_back((track.tip[i] - track.tip[i - 1]).norm() / dt.back());
        info.gaps += dt.back() > tracking::kGapS;
        info.low = info.low.cwiseMin(track.tip[i]);
        info.high = info.high.cwiseMax(track.tip[i]);
    }
    info.dt_min_s = quantile(dt, 0);
    info.dt_median_s = quantile(dt, 0.5);
    info.dt_max_s = quantile(dt, 1);
    info.rate_hz = 1 / info.dt_median_s;
    info.speed_median_mps = quantile(speed, 0.5);
    info.speed_p95_mps = quantile(speed, 0.95);
    info.speed_max_mps = quantile(speed, 1);
    info.orientation = std::ranges::all_of(stick.samples, &tracking::PoseSample::has_orientation);
    for (std::size_t i = 1; i < stick.samples.size(); ++i) {
        if (stick.samples[i].orientation.angularDistance(stick.samples[i - 1].orientation) <= kFlip) continue;
        if (info.flips++ == 0) info.first_flip_s = stick.samples[i].t_s;
    }
    info.strokes = static_cast<int>(find_lows(track).size());
    return info;
}

std::string point(const Eigen::Vector3d& p) {
    return fmt::format("({:.3f}, {:.3f}, {:.3f})", p.x(), p.y(), p.z());
}

nlohmann::ordered_json numbers(const Eigen::Vector3d& p) {
    return {p.x(), p.y(), p.z()};
}

nlohmann::ordered_json json_of(const StickInfo& s) {
    return {
        {"name", s.name},
        {"samples", s.samples},
        {"t0_s", s.t0_s},
        {"t_end_s", s.t_end_s},
        {"duration_s", s.t_end_s - s.t0_s},
        {"rate_hz", s.rate_hz},
        {"dt_s", {{"min", s.dt_min_s}, {"median", s.dt_median_s}, {"max", s.dt_max_s}}},
        {"gaps", s.gaps},
        {"tip_min_m", numbers(s.low)},
        {"tip_max_m", numbers(s.high)},
        {"speed_mps", {{"median", s.speed_median_mps}, {"p95", s.speed_p95_mps}, {"max", s.speed_max_mps}}},
        {"has_orientation", s.orientation},
        {"flips", s.flips},
        {"strokes", s.strokes}};
}

std::vector<StickInfo> sticks_of(const tracking::Trace& trace) {
    const std::vector<TipTrack> tracks = tip_tracks(trace, stick_geometry(trace, {}, {}, {}));
    std::vector<StickInfo> sticks;
    for (std::size_t i = 0; i < tracks.size(); ++i) sticks.push_back(info_of(trace.sticks[i], tracks[i]));
    return sticks;
}

}  // namespace

std::string format_info(const tracking::Trace& trace) {
    const std::vector<StickInfo> sticks = sticks_of(trace);
    std::string text = fmt::format("{}: {:.6g} s, {}\n", trace.file, trace.t_end_s() - trace.t0_s(),
                                   counted(sticks.size(), "stick"));
    text += fmt::format("  source       {}\n", trace.source.empty() ? "(not said)" : trace.source);
    text += fmt::format("  nominal rate {}\n",
                        trace.rate_hz > 0 ? fmt::format("{} Hz", trace.rate_hz) : "(not said)");
    text += fmt::format("  tip          {}\n",
                        trace.tip ? point(*trace.tip) + " m" : "(not said; the tracked point)");
    for (const std::string& remark : trace.remarks) text += fmt::format("  remark       {}\n", remark);
    for (const StickInfo& s : sticks) {
        text += fmt::format("\n{}: {} from {:.9g} to {:.9g} s\n", s.name, counted(s.samples, "sample"),
                            s.t0_s, s.t_end_s);
        text += fmt::format(
            "  rate         {:.2f} Hz; steps {:.3f}, {:.3f}, {:.3f} ms (shortest, median, longest)\n",
            s.rate_hz, 1e3 * s.dt_min_s, 1e3 * s.dt_median_s, 1e3 * s.dt_max_s);
        text += fmt::format("  gaps         {} over {} s\n", s.gaps, tracking::kGapS);
        text += fmt::format("  tip within   {} to {} m\n", point(s.low), point(s.high));
        text += fmt::format("  tip speed    {:.2f}, {:.2f}, {:.2f} m/s (median, 95 %, fastest)\n",
                            s.speed_median_mps, s.speed_p95_mps, s.speed_max_mps);
        text += fmt::format("  strokes      {} (falls and rises of 25 mm and more)\n", s.strokes);
        text += fmt::format("  orientation  {}\n", s.orientation ? "yes" : "no, or not throughout");
        if (s.flips > 0)
            text +=
                fmt::format("  flips        {} by more than 90 degrees in a step, the first at {:.9g} s\n",
                            counted(s.flips, "turn"), s.first_flip_s);
    }
    return text;
}

std::string format_info_json(const tracking::Trace& trace) {
    nlohmann::ordered_json json = {
        {"trace", trace.file},  {"source", trace.source},     {"rate_hz", trace.rate_hz},
        {"t0_s", trace.t0_s()}, {"t_end_s", trace.t_end_s()}, {"duration_s", trace.t_end_s() - trace.t0_s()},
        {"tip_m", nullptr},     {"shaft", nullptr},           {"sticks", nlohmann::ordered_json::array()}};
    json["remarks"] = trace.remarks;
    json["warnings"] = tracking::implausible(trace);
    if (trace.tip) json["tip_m"] = numbers(*trace.tip);
    if (trace.shaft) json["shaft"] = numbers(*trace.shaft);
    for (const StickInfo& stick : sticks_of(trace)) json["sticks"].push_back(json_of(stick));
    return json_document(json);
}

}  // namespace app
