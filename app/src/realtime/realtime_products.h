#pragma once
#include <string>

#include "files/output_folder.h"
#include "realtime/play_realtime.h"

namespace app {

/// Measures the latency of a run whose strikes are scored (outcome.latency) and writes what a run in real
/// time has beside the products of play(): departures.csv, latency.json, latency.html, samples.csv,
/// frames.csv, notes.csv, blocks.csv, leads.csv, errors.csv. Returns summary.json's object `realtime`.
[[nodiscard]] std::string write_realtime_products(RealtimeOutcome& outcome, const OutputFolder& folder);

}  // namespace app
