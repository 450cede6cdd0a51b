#pragma once
#include <cstdint>
#include <string>

namespace audio {

/// How p2 must be given so that a note sent just before its onset's block sounds exactly at its onset.
///
/// With `--sample-accurate` an event `offset` samples into the coming block should need p2 = offset / sr.
/// Csound 6.18 starts events of the block's second half one whole block late; there p2 is taken a block
/// earlier (and may be negative). A hundredth of a sample keeps the rounding of p2 * sr away from the border.
///   exact:      p2 = (offset + 0.01) / sr
///   half_block: p2 = (offset + 0.01) / sr - (2 offset >= block ? block / sr : 0)
enum class OnsetRule : std::uint8_t { exact, half_block };

/// Seconds from the block's start, for an onset `offset` samples (0 ... block_size - 1) into it.
[[nodiscard]] double onset_p2(OnsetRule rule, int offset, int block_size);

/// Renders an impulse at each phase of a block by either rule and returns the one by which every impulse is
/// exact; throws std::runtime_error where neither is. Uses a Csound instance of its own, on the calling
/// thread (some ms).
[[nodiscard]] OnsetRule probe_onset_rule(int block_size);

[[nodiscard]] std::string describe(OnsetRule rule);

}  // namespace audio
