#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "kit/kit.h"
#include "latency/timings.h"
#include "play/play.h"

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

}  // namespace app
