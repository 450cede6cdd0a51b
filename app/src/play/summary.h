#pragma once
#include <string>

#include "play/play_result.h"

namespace app {

/// Text of summary.json: one object, keys in a fixed order, numbers that read back to the same double. The
/// keys that scripts rely on come first; times in seconds unless the name says _ms. timing_ms.median and .p95
/// are null when no note matched a contact, realtime_factor when no wall time was measured. Apart from
/// realtime_factor, stages_s and wall_s the text is a pure function of the input.
[[nodiscard]] std::string format_summary(const PlayResult& result, const std::string& realtime_json = {});

}  // namespace app
