#pragma once
#include <string>

#include "play/play_result.h"

namespace app {

// Parts of report.html that hold no plots; all are pure functions of the result.

[[nodiscard]] std::string report_heading(const PlayResult& result);
[[nodiscard]] std::string report_figures(const PlayResult& result);
/// A row an instrument that was struck or meant to be.
[[nodiscard]] std::string report_instruments(const PlayResult& result);
/// Stages, inputs, versions and counts.
[[nodiscard]] std::string report_provenance(const PlayResult& result);

}  // namespace app
