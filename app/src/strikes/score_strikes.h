#pragma once
#include <vector>

#include "strikes/strike.h"
#include "strikes/strike_score.h"

namespace app {

/// A note and a true contact of the same stick and instrument belong together when they lie within this time
/// [s] of each other.
inline constexpr double kMatchWindow_s = 0.030;

/// Compares the released notes with the true contacts: closest pairs first (equally close ones by contact
/// time, then by id), each note and each contact used once. Fills matched_id of every contact (0: missed) and
/// counts
///   moved   released strikes with moves > 0
///   false   released strikes without a contact
///   missed  contacts without a released strike
///   timing  median and p95 of |onset - contact| [ms] over the matched notes; kNoValue when nothing matched
/// The false_turned_* counts are left at 0: they need the recorded path.
/// `contacts` must be sorted by time. A pure function of its input; O((n + m) log n) for n contacts and m
/// strikes that are not denser than a few in the window.
[[nodiscard]] StrikeScore score_strikes(const std::vector<Strike>& strikes,
                                        std::vector<TrueContact>& contacts);

}  // namespace app
