#pragma once
#include "commands/command.h"
#include "realtime/play_realtime.h"

namespace app {

/// Adds `play` to the program.
void add_play_command(Command& program);

/// Options of a run that `play` and `latency` share: all but the folder to write into. Returns TRACE.
Option add_play_options(Command& command, PlayOptions& options);
/// Those of a run in real time. `trace` is what --source replaces.
std::vector<Option> add_realtime_options(Command& command, RealtimeOptions& options, const Option& trace);

}  // namespace app
