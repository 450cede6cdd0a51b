#pragma once
#include <string>
#include <string_view>

#include "tracking/trace.h"

namespace tracking {

/// True for bytes that begin as an XROR recording: a BSON document with `info` or `$schema` at its beginning.
[[nodiscard]] bool is_xror(std::string_view bytes);

/// Reads an Extended Reality Open Recording (github.com/MetaGuard/xror, schema 1.0.0): a BSON document whose
/// `frames` are a table of floats compressed by fpzip: the time [s], then each device's axes (`x y z i j k
/// 1`). The hands (joint HAND_LEFT, HAND_RIGHT) become the sticks left and right; without hands each device
/// with a position that is no headset becomes a stick of its name. Coordinates are Unity's by the format's
/// convention: metres, left-handed, y up, mirrored to ours as in replays; shaft -z; tip (0, 0, -0.35) for the
/// application Beat Saber.
///
/// Left out and counted in Trace::remarks: frames that do not count (replay_frames.h), poses without an
/// orientation (four zeros: not tracked), other devices, and events. Names of people are not kept.
///
/// Throws TraceError: FILE:byte N: error: found ..., expected ...; what to do. Memory is bounded by the
/// file's size: a table has at most 64 floats a byte, and 2^25.
[[nodiscard]] Trace parse_xror(std::string_view bytes, const std::string& name);

}  // namespace tracking
