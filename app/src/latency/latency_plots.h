#pragma once
#include "latency/latency_report.h"
#include "report/plot_gallery.h"

namespace app {

/// Share of the values that are longer, over the value; a line a stage of that kind. Both axes logarithmic,
/// so that a straight look shows 1 in 2, in 20, in 100 and the rare ones.
[[nodiscard]] PlotWithLegend stage_plot(const LatencyReport& report, LatencyStage::Kind kind);
/// Leads in force and the delays that they follow over the run.
[[nodiscard]] PlotWithLegend leads_plot(const RealtimeResult& realtime);
/// Sound minus picture, with the limits of ITU-R BT.1359 and ATSC and the 10 +- 3 ms of drummers beside it.
[[nodiscard]] PlotWithLegend sound_picture_plot(const LatencyReport& report);
/// The same close up: 80 ms about the median, 1 ms a bin; and against the first frame behind the surface.
[[nodiscard]] PlotWithLegend sound_picture_close_plot(const LatencyReport& report);
/// When each frame's pixels were there, before (below 0) or after it was due; missed ones marked.
[[nodiscard]] PlotWithLegend frames_plot(const RealtimeResult& realtime);
/// RMS error of the drawn sticks, half a second a point.
[[nodiscard]] PlotWithLegend error_plot(const LatencyReport& report);

}  // namespace app
