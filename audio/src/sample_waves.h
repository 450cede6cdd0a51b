#pragma once
#include <string>
#include <vector>

#include "audio/performance.h"
#include "region_text.h"

namespace audio {

inline constexpr std::size_t kWaveGuard = 96;  ///< samples of silence at a wave's end, 2 ms
inline constexpr double kLongestLoopS = 60;    ///< that a looped sample sounds at most

/// Resamples a channel so that `ratio` times as many samples last as long. Throws SampleError, at `place`.
[[nodiscard]] std::vector<float> resampled(const std::vector<float>& samples, double ratio,
                                           const std::string& place);

/// How much higher a region sounds at a key than it was recorded [cents].
[[nodiscard]] double tuning_cents(const WrittenRegion& r, int key);

struct Wave {
    std::vector<float> samples;
    std::size_t cut_frames = 0;  ///< of the recording, loops as often as heard: what was resampled
};

/// What is heard of one channel at a key, at 48 kHz: cut, looped, tuned, shaped, then kWaveGuard of silence. Throws
/// SampleError.
[[nodiscard]] Wave make_wave(const WrittenRegion& r, const Recording& recording, int channel, int key);

}  // namespace audio
