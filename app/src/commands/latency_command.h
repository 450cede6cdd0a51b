#pragma once
#include <functional>

#include "commands/command.h"
#include "realtime/play_realtime.h"

namespace app {

/// Plays in real time into the folder of the options.
using RunInTime = std::function<RealtimeOutcome(const RealtimeOptions&)>;

/// Adds `latency` to the program: play_realtime(), or `run` in its place, and what it measured.
void add_latency_command(Command& program, const RunInTime& run = {});

}  // namespace app
