#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "realtime/play_realtime.h"

namespace app {

/// The options of a run in real time as typed, the same in `play --realtime` and `latency`.
struct RealtimeArguments {
    std::string seconds, source, sticks = "left,right", lead = "fixed", output_lead = "0.004",
                                 priority = "auto";
    std::string midi_out, disturb;
    bool jack = false;
};

/// Adds them to a command; returns the options.
std::vector<CLI::Option*> add_realtime_options(CLI::App& command, RealtimeArguments& arguments);

/// Throws BadInput for what they cannot be.
[[nodiscard]] RealtimeOptions realtime_options(const PlayOptions& play, const RealtimeArguments& arguments);

}  // namespace app
