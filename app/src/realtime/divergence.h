#pragma once
#include <tracking/trace.h>

#include "realtime/play_realtime.h"

namespace app {

/// Plays the trace offline (no frames, no sound, in this process) and fills in `departures` and
/// `offline_strikes`: each strike of each lap against the offline strike of the same stick and instrument
/// next to it (30 ms). Equal: the same outcome, the same onset to the sample and the same speed (within a
/// millionth). A difference is explained by the greatest delay met by samples of any stick (the bodies are
/// common to all) between two seconds before the strike was first predicted and its decision: samples that
/// came later than they could still change the sound (late_s > 0), or were never seen; or by the end of the
/// run within its lap.
void find_departures(RealtimeOutcome& outcome, const tracking::Trace& trace, const PlayOptions& options);

}  // namespace app
