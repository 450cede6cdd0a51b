#pragma once
#include <string>

#include "latency/latency_report.h"
#include "report/table.h"

namespace app {

// The figures of a run in real time, each in one table, from which terminal, page and JSON are made.

/// Latency of each stage [ms].
[[nodiscard]] Table stage_table(const LatencyReport& report);
/// How often each thing that has to be done by a time was not.
[[nodiscard]] Table deadline_table(const LatencyReport& report);
/// Sound minus picture [ms], against the drawn path and against the first frame behind the surface; a row
/// without values if there are none.
[[nodiscard]] Table spread_table(const LatencyReport& report);
/// The clocks of the sensors' sources.
[[nodiscard]] Table clock_table(const RealtimeResult& realtime);

// The rows behind the figures. Times in ns and `at_s` count from the run's epoch, `t_s` and `onset_s` are on
// the lap's clock.

/// stick,lap,t_s,due_ns,read_ns,filtered_ns,taken_ns,query_ns,contact_ns,handed_ns,skipped,late_s
[[nodiscard]] Table sample_table(const PlayResult& play, const RealtimeResult& realtime);
/// index,fate,asked_for,lead_s,quality,pose_age_s,shown_ns,query_ns,started_ns,drawn_ns,read_ns,written_ns
[[nodiscard]] Table frame_table(const RealtimeResult& realtime);
/// id,stick,instrument,lap,onset_s,late_s,pose_age_s,planned_sample,onset_sample,taken_ns,midi_sent_ns,touch_s,
/// sound_minus_picture_ms,sound_minus_frame_ms: onset_s in the output; the last three empty without a picture
[[nodiscard]] Table note_table(const LatencyReport& report, const PlayResult& play,
                               const RealtimeResult& realtime);
/// planned_ns,started_ns,done_ns
[[nodiscard]] Table block_table(const RealtimeResult& realtime);
/// at_s,render_lead_s,sound_lead_s,render_delay_s,sound_delay_s,quality,fps,why
[[nodiscard]] Table lead_table(const RealtimeResult& realtime);
/// at_s,stick,error_mm
[[nodiscard]] Table error_table(const LatencyReport& report, const PlayResult& play);

/// Text of latency.json, and of `latency --json`: stages, frames, notes, sound_minus_picture_ms,
/// lead_needed_ms, deadlines, errors of the drawn sticks, and what ran where.
[[nodiscard]] std::string format_latency_json(const LatencyReport& report, const PlayResult& play,
                                              const RealtimeResult& realtime);
/// The same for the terminal.
[[nodiscard]] std::string format_latency_text(const LatencyReport& report, const RealtimeResult& realtime);

}  // namespace app
