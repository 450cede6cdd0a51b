#pragma once
#include <optional>
#include <span>

namespace audio {

/// What EBU R 128 says of a sound; absent where it says nothing (silence, or too short: 0.4 s for the loudness,
/// 3 s for its range).
struct Loudness {
    std::optional<double> integrated_lufs;  ///< ITU-R BS.1770-4, gated
    std::optional<double> range_lu;         ///< EBU Tech 3342
    std::optional<double> true_peak_dbtp;   ///< of four times as many samples (BS.1770-4, annex 2)
};

/// Of interleaved stereo at 48 kHz, by libebur128. Throws std::bad_alloc.
[[nodiscard]] Loudness measure_loudness(std::span<const float> interleaved);

/// Gain [dB] that brings a sound to `target_lufs`, or as near as its true peak allows, which stays at or below
/// `highest_dbtp`. 0 for silence.
[[nodiscard]] double gain_towards(const Loudness& loudness, double target_lufs, double highest_dbtp);

}  // namespace audio
