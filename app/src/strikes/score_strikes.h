#pragma once
#include <vector>

#include "statistics/statistics.h"
#include "strikes/strike.h"

namespace app {

/// A note and a true contact of the same stick and instrument belong together when they lie within this time
/// [s] of each other.
inline constexpr double kMatchWindow_s = 0.030;

/// How the notes of a run compare with the true contacts.
struct StrikeScore {
    int true_contacts = 0, released = 0, cancelled = 0, moved = 0, false_notes = 0, missed = 0;
    int false_turned_early =
        0;  ///< false notes whose true path turned back at least 25 ms before the release point
    int false_turned_late = 0;  ///< the other false notes
    /// Of |onset - true contact| over the matched notes; kNoValue when none matched.
    double timing_median_ms = kNoValue, timing_p95_ms = kNoValue;
};

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
