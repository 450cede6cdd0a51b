#pragma once
#include <functional>

#include "commands/command.h"
#include "realtime/play_realtime.h"

namespace app {

/// Adds `play` to the program.
void add_play_command(Command& program);

/// Options of a run that `play` and `latency` share: all but the folder to write into. Returns TRACE.
CLI::Option* add_play_options(Command& command, PlayOptions& options);
/// Those of a run in real time. `trace` is what --source replaces.
std::vector<CLI::Option*> add_realtime_options(Command& command, RealtimeOptions& options,
                                               CLI::Option* trace);

/// Plays in real time into the folder of the options, warnings on standard error.
RealtimeOutcome play_realtime_and_warn(const RealtimeOptions& options);

/// Plays in real time into the folder of the options.
using RunInTime = std::function<RealtimeOutcome(const RealtimeOptions&)>;

/// Adds `latency` to the program: `run`, and what it measured.
void add_latency_command(Command& program, const RunInTime& run = play_realtime_and_warn);

}  // namespace app
