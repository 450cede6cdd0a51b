#pragma once
#include <functional>

#include "commands/play_command.h"

namespace app {

/// Plays in real time into the folder of the options.
using RunInTime = std::function<RealtimeOutcome(const RealtimeOptions&)>;

/// Adds `latency` to the program: `run`, and what it measured.
void add_latency_command(Command& program, const RunInTime& run = play_realtime_and_warn);

}  // namespace app
