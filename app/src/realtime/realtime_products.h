#pragma once
#include <tracking/trace.h>

#include "files/output_folder.h"
#include "realtime/play_realtime.h"

namespace app {

/// What a run in real time has beside play()'s products, as JSON for summary.json's key `realtime`: seconds,
/// laps, frames and notes in time, departures from the offline run, sensors' events and clocks, priorities.
[[nodiscard]] std::string format_realtime_section(const RealtimeOutcome& outcome);
/// Rows of departures.csv.
[[nodiscard]] std::string format_departures(const RealtimeOutcome& outcome);
/// Writes all files of a run in real time but frames, audio.wav, hits.mid and those of latency.
void write_realtime_products(const RealtimeOutcome& outcome, const OutputFolder& folder);
/// latency.json, latency.html, samples.csv, frames.csv, notes.csv, blocks.csv, leads.csv, errors.csv.
void write_latency_products(const RealtimeOutcome& outcome, const OutputFolder& folder);

}  // namespace app
