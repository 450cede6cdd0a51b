#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "kit/kit.h"
#include "latency/timings.h"
#include "play/play_result.h"

namespace app {

/// How long the picture is searched before and after a note for the stroke that belongs to it [s].
inline constexpr double kPictureWindowS = 0.150;

/// A note and the stroke that the screen shows for it. Times on the lap's clock.
struct SoundPicture {
    std::size_t note = 0;  ///< index into RealtimeResult::notes
    double onset_s = 0;    ///< of the note in the output
    double touch_s =
        0;  ///< the drawn path comes into the instrument's rest surface grown by the tip's radius
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
[[nodiscard]] std::vector<SoundPicture> sound_and_picture(const PlayResult& play,
                                                          const RealtimeResult& realtime, const Kit& kit,
                                                          double tip_radius_m);

/// When the note began in the output, on its lap's clock.
[[nodiscard]] double onset_in_lap_s(const NoteTiming& note, double t0_s, double period_s);

}  // namespace app
