#pragma once
#include <span>
#include <string_view>

#include "latency_report.h"
#include "output_folder.h"

namespace app {

/// What `latency --out` writes: latency.json, samples.csv, frames.csv, notes.csv, blocks.csv, leads.csv,
/// errors.csv, report.html. The first leads (OutputFolder).
[[nodiscard]] std::span<const std::string_view> latency_products();

/// Writes them into `out`, which was made for these products or for more; the caller finishes it.
void write_latency_products(OutputFolder& out, const LatencyReport& report, const PlayResult& play,
                            const RealtimeResult& realtime);

}  // namespace app
