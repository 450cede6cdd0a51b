#pragma once
#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "latency/screen_path.h"
#include "report/table.h"
#include "statistics/statistics.h"

namespace app {

/// How values spread.
class Spread {
public:
    Spread() = default;
    explicit Spread(std::vector<double> values) : sorted_(std::move(values)) { std::ranges::sort(sorted_); }

    [[nodiscard]] bool empty() const { return sorted_.empty(); }
    [[nodiscard]] std::size_t count() const { return sorted_.size(); }
    /// The quantile of percent / 100; NaN for no values.
    [[nodiscard]] double percentile(double percent) const {
        return quantile_of_sorted(sorted_, percent / 100);
    }
    /// Share of the values within [low, high].
    [[nodiscard]] double share_within(double low, double high) const;
    [[nodiscard]] const std::vector<double>& sorted() const { return sorted_; }

private:
    std::vector<double> sorted_;
};

/// One step on the way from a sensor to ear or eye, over all that took it.
struct LatencyStage {
    enum class Kind { sound, picture, age };
    std::string name, meaning;  ///< meaning: from what to what, a few words
    Kind kind = Kind::sound;
    Spread ms;
};

/// How often something had to be done by a time, and was not.
struct Deadline {
    std::string name, meaning;
    std::size_t total = 0, missed = 0;
};

/// Limits of sound minus picture [ms]: sound may be early by the first and late by the second. ATSC's is for
/// production, ITU-R BT.1359's is where people begin to notice.
struct AvLimits {
    double early_ms, late_ms;
};
inline constexpr AvLimits kAtscLimits{-15, 45}, kItuLimits{-45, 125};
/// Latency that drummers rate as none, and the jitter beside it that they do not [ms].
inline constexpr double kDrummersLatencyMs = 10, kDrummersJitterMs = 3;

/// The latency measured in a run in real time.
struct LatencyReport {
    /// Durations [ms], in the order in which a sample takes them: from sensor to filter, application,
    /// simulation and sound, then from the query for a frame to its file; the ages of poses in frames and
    /// notes. A stage that nothing took is left out.
    std::vector<LatencyStage> stages;
    Deadline samples;  ///< taken; missed: too late to change the sound
    Deadline skipped;  ///< given by the sensors; missed: never seen by the application
    Deadline notes;    ///< sounded; missed: later than planned
    Deadline strokes;  ///< true contacts; missed: no note belongs to it
    Deadline blocks;   ///< of sound; missed: done after they were due
    Deadline frames;   ///< asked for; missed: late or not drawn
    [[nodiscard]] std::array<const Deadline*, 6> deadlines() const {
        return {&samples, &skipped, &notes, &strokes, &blocks, &frames};
    }
    std::size_t frames_late = 0, frames_skipped = 0;  ///< of those asked for: drawn too late, not drawn
    std::size_t frames_left_out = 0;                  ///< not asked for since the rate was lowered
    std::vector<SoundPicture> pictures;               ///< of the notes that the drawn sticks play, too
    std::size_t notes_without_picture = 0;
    Spread sound_minus_picture_ms, sound_minus_frame_ms;
    /// Share of the notes with a picture; none where there are none.
    [[nodiscard]] std::optional<double> share_within(const AvLimits& limits) const;
    std::vector<DrawnError> errors;
    std::optional<double> rms_error_mm;  ///< of all of them
    /// p99 of "frame in all": what the render lead must cover so that 99 of 100 frames are in time.
    std::optional<double> render_lead_needed_ms;
    /// p99 of "sample to notes" plus the output lead plus p99 of "block computed": what the sound lead must
    /// cover so that a contact predicted at a sample can still sound on time. Blocks that are done within the
    /// output lead are counted twice, to be on the safe side.
    std::optional<double> sound_lead_needed_ms;
};

/// `play.tracks` are on the run's clock, t0 + time since the epoch; of `play.strikes` stick and instrument
/// count. The strikes have been scored (`play.score`).
[[nodiscard]] LatencyReport latency_report(const PlayResult& play, const RealtimeResult& realtime,
                                           const Kit& kit, double tip_radius_m);

/// By name; null if nothing took it.
[[nodiscard]] const LatencyStage* find_stage(const LatencyReport& report, std::string_view name);

/// "1.2 ms", or "unknown" for none.
[[nodiscard]] std::string milliseconds(const std::optional<double>& value);

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

/// The rows behind the figures, by the files that they are written to: samples.csv, frames.csv, notes.csv,
/// blocks.csv, leads.csv, errors.csv. Times in ns and `at_s` count from the run's epoch, `t_s` and `onset_s`
/// are on the lap's clock, onset_s in the output. The last three columns of a note without a picture are
/// empty.
[[nodiscard]] std::vector<std::pair<const char*, Table>> latency_rows(const LatencyReport& report,
                                                                      const PlayResult& play,
                                                                      const RealtimeResult& realtime);

/// Text of latency.json, and of `latency --json`: stages, frames, notes, sound_minus_picture_ms,
/// lead_needed_ms, deadlines, errors of the drawn sticks, and what ran where.
[[nodiscard]] std::string format_latency_json(const LatencyReport& report, const PlayResult& play,
                                              const RealtimeResult& realtime);
/// Text of latency's report.html: figures, stages, plots, what ran where. Plots are drawn by gnuplot with
/// temporary files in `scratch`. In latency_page.cpp.
[[nodiscard]] std::string format_latency_page(const LatencyReport& report, const PlayResult& play,
                                              const RealtimeResult& realtime,
                                              const std::filesystem::path& scratch);
/// For the terminal.
[[nodiscard]] std::string format_latency_text(const LatencyReport& report, const RealtimeResult& realtime);

}  // namespace app
