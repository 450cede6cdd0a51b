#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kit/kit.h"
#include "latency/timings.h"
#include "play/play.h"
#include "report/plot.h"
#include "report/table.h"
#include "statistics/statistics.h"

namespace app {

/// How long the picture is searched before and after a note for the stroke that belongs to it [s].
inline constexpr double kPictureWindowS = 0.150;

/// A note and the stroke that the screen shows for it. Times on the lap's clock.
struct SoundPicture {
    std::size_t note = 0;  ///< index into RealtimeResult::notes
    double onset_s = 0;    ///< of the note in the output
    /// The drawn path comes into the instrument's rest surface grown by the tip's radius.
    double touch_s = 0;
    std::optional<double> frame_s;  ///< of the first frame that shows the stick at or behind the surface

    /// Positive: sound late.
    [[nodiscard]] double sound_minus_picture_ms() const { return 1e3 * (onset_s - touch_s); }
    /// The same against that frame: up to a frame less, since the screen shows no time in between.
    [[nodiscard]] std::optional<double> sound_minus_frame_ms() const {
        return frame_s ? std::optional(1e3 * (onset_s - *frame_s)) : std::nullopt;
    }
};

/// For each note the nearest way in of the drawn path of its stick, in its lap, through its instrument's
/// surface, within kPictureWindowS; notes without one are left out. In order of the notes.
///
/// The drawn path is the path of a stick's tip as the screen shows it during one lap: a cubic Hermite curve
/// through the tips and their velocities of the frames that were shown in time, on the lap's clock. The tips
/// are those that were predicted for the frames (DrawnTip), before a stick that meets a surface is held there.
/// No curve joins frames more than 0.25 s apart. Ways in are found to 1e-11 s; dips of less than 0.5 mm along
/// the path may be passed over.
[[nodiscard]] std::vector<SoundPicture> sound_and_picture(const PlayResult& play,
                                                          const RealtimeResult& realtime, const Kit& kit,
                                                          double tip_radius_m);

/// When the note began in the output, on its lap's clock.
[[nodiscard]] double onset_in_lap_s(const NoteTiming& note, double t0_s, double period_s);

/// How far the stick on the screen is from the true one at the time when a frame is due.
struct DrawnError {
    double at_s = 0;  ///< since the run's epoch
    std::uint32_t stick = 0;
    double error_m = 0;  ///< from the tip as drawn to the recorded tip
};

/// For each frame that was asked for and each stick: what is on the screen when the frame is due is the last
/// frame that was in time; a missed one leaves the picture before it standing. The truth is the measured path
/// (`tracks`, by stick, on the run's clock: `t0_s` at the epoch), straight between samples. Left out: before
/// a stick's first picture in a lap, and between samples more than tracking::kGapS apart.
[[nodiscard]] std::vector<DrawnError> drawn_errors(const RealtimeResult& realtime,
                                                   std::span<const TipTrack> tracks, double t0_s);

/// Root mean square of the errors from `from_s` up to `to_s` [mm]; 0 for none. By time, as above.
[[nodiscard]] double rms_mm(std::span<const DrawnError> errors, double from_s, double to_s);

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
/// The clock of each stick's source.
[[nodiscard]] Table clock_table(const PlayResult& play, const RealtimeResult& realtime);

/// The rows behind the figures, by the files that they are written to: samples.csv, frames.csv, notes.csv,
/// blocks.csv, leads.csv, errors.csv. Times in ns and `at_s` count from the run's epoch, `t_s` and `onset_s`
/// are on the lap's clock, onset_s in the output. The last three columns of a note without a picture are
/// empty. One after the other, since those of a long run are large; while the arguments last.
[[nodiscard]] std::vector<std::pair<const char*, std::function<Table()>>> latency_rows(
    const LatencyReport& report, const PlayResult& play, const RealtimeResult& realtime);

/// Text of latency.json, and of `latency --json`: stages, frames, notes, sound_minus_picture_ms,
/// lead_needed_ms, deadlines, errors of the drawn sticks, and what ran where.
[[nodiscard]] std::string format_latency_json(const LatencyReport& report, const PlayResult& play,
                                              const RealtimeResult& realtime);
/// Text of latency's report.html: figures, stages, plots, what ran where. In latency_page.cpp.
[[nodiscard]] std::string format_latency_page(const LatencyReport& report, const PlayResult& play,
                                              const RealtimeResult& realtime, Plotter& plotter);
/// For the terminal.
[[nodiscard]] std::string format_latency_text(const LatencyReport& report, const RealtimeResult& realtime);

}  // namespace app
