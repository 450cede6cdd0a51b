#pragma once
#include <tracking/trace.h>

#include <string>

namespace app {

/// What a trace holds: for each stick its times, rates, gaps, the extents and speeds of its tip, its strokes
/// and its orientation. As text and as one JSON document.
[[nodiscard]] std::string format_info(const tracking::Trace& trace);
[[nodiscard]] std::string format_info_json(const tracking::Trace& trace);

}  // namespace app
