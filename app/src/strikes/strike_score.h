#pragma once
#include "statistics/statistics.h"

namespace app {

/// How the notes of a run compare with the true contacts.
struct StrikeScore {
    int true_contacts = 0, released = 0, cancelled = 0, moved = 0, false_notes = 0, missed = 0;
    int false_turned_early =
        0;  ///< false notes whose true path turned back at least 25 ms before the release point
    int false_turned_late = 0;  ///< the other false notes
    /// Of |onset - true contact| over the matched notes; kNoValue when none matched.
    double timing_median_ms = kNoValue, timing_p95_ms = kNoValue;
};

}  // namespace app
