#pragma once
#include <string>
#include <string_view>

#include "tracking/trace.h"

namespace tracking {

/// True for a file that begins like a Beat Saber Open Replay (0x442d3d69, little endian).
[[nodiscard]] bool is_bsor(std::string_view bytes);

/// Reads the frames of a Beat Saber Open Replay, version 1 (github.com/BeatLeader/BS-Open-Replay): the two
/// sabers' poses, mirrored from the game's left-handed axes to right-handed ones: p = (x, y, -z),
/// q = (w, -x, -y, z); tip (0, 0, -0.35), shaft -z. Song time in seconds.
///
/// Left out and counted in Trace::remarks: frames not later than the ones before, and the start-up up to the
/// last step of over 30 m/s in the first 0.5 s (sabers that still lie at the origin). Sections after the
/// frames are not read. Names of people are not kept.
///
/// Throws TraceError: FILE:byte N: error: found ..., expected ...; what to do. Memory is bounded by the
/// file's size.
[[nodiscard]] Trace parse_bsor(std::string_view bytes, const std::string& name);

}  // namespace tracking
