#pragma once
#include <tracking/trace.h>

#include "output_folder.h"
#include "play_realtime.h"

namespace app {

/// What a run in real time has beside play()'s products, as JSON for summary.json's key `realtime`: seconds,
/// laps, frames and notes in time, departures from the offline run, sensors' events and clocks, priorities.
[[nodiscard]] std::string format_realtime_section(const RealtimeOutcome& outcome);
/// Rows of departures.csv.
[[nodiscard]] std::string format_departures(const RealtimeOutcome& outcome);
/// Writes all files of a run in real time but frames, audio.wav and hits.mid.
void write_realtime_products(const RealtimeOutcome& outcome, const tracking::Trace& trace,
                             const OutputFolder& folder);

}  // namespace app
