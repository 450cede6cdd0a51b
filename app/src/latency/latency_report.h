#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kit/kit.h"
#include "latency/drawn_error.h"
#include "latency/sound_picture.h"
#include "latency/timings.h"
#include "play/play_result.h"

namespace app {

/// How values spread.
class Spread {
public:
    Spread() = default;
    explicit Spread(std::vector<double> values);

    [[nodiscard]] bool empty() const { return sorted_.empty(); }
    [[nodiscard]] std::size_t count() const { return sorted_.size(); }
    /// The quantile of percent / 100; NaN for no values.
    [[nodiscard]] double percentile(double percent) const;
    [[nodiscard]] double min() const { return sorted_.empty() ? 0 : sorted_.front(); }
    [[nodiscard]] double max() const { return sorted_.empty() ? 0 : sorted_.back(); }
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
    /// simulation and sound, then from the query for a frame to its file. A stage that nothing took is left
    /// out.
    ///
    ///   sensor to filter     sample due to all its filters done
    ///   filter to app        that to the application having it
    ///   query                of the shared memory
    ///   contact              the application having it to the simulation's answer
    ///   note hand-over       that to its notes being with the audio
    ///   sample to notes      due to notes being with the audio
    ///   block computed       planned to done
    ///   frame query          poses and simulation asked
    ///   frame drawn          drawing begun to ended
    ///   frame read back      that to pixels being there
    ///   frame in all         query begun to pixels there
    ///   frame written        pixels there to the file written
    ///   pose age in frames   shown minus the oldest stick's sample
    ///   pose age in notes    onset minus the newest sample that could change it
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
    /// Share of the notes within ATSC's limit; one without a picture is not.
    [[nodiscard]] double share_within_atsc() const;
    /// Share of those with a picture within ITU-R BT.1359's limits.
    [[nodiscard]] double share_within_itu() const;
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

}  // namespace app
