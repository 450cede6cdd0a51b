#pragma once
#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "kit.h"
#include "play_result.h"
#include "realtime_result.h"
#include "tip_track.h"

namespace app {

/// What is measured: a run in real time without products of its own.
struct LatencyArguments {
    std::string trace = "flourish";  ///< file or name of a bundled one
    std::string kit = "drums";
    double seconds = 60;
};

/// What a run in real time leaves for its reports.
struct MeasuredRun {
    PlayResult play;
    RealtimeResult realtime;
    Kit kit;
    StickGeometry geometry;
    tracking::Trace trace;
};
using MeasureRun = std::function<MeasuredRun(const LatencyArguments&)>;

/// Adds `latency` to the program. `measure` makes the run; --compare does without.
void add_latency_command(CLI::App& program, const MeasureRun& measure);

}  // namespace app
