#pragma once
#include <filesystem>
#include <string>

#include "latency/latency_report.h"

namespace app {

/// Text of latency's report.html: figures, stages, plots, what ran where. Plots are drawn by gnuplot with
/// temporary files in `scratch`.
[[nodiscard]] std::string format_latency_page(const LatencyReport& report, const PlayResult& play,
                                              const RealtimeResult& realtime,
                                              const std::filesystem::path& scratch);

}  // namespace app
