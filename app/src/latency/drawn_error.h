#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "kit/tip_track.h"
#include "latency/timings.h"
#include "play/play_result.h"

namespace app {

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
