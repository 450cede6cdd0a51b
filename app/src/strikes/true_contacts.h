#pragma once
#include <sim/modal_body.h>
#include <sim/simulation.h>

#include <optional>
#include <span>
#include <vector>

#include "kit/kit.h"
#include "statistics/statistics.h"
#include "strikes/strike.h"

namespace app {

/// A note and a true contact of the same stick and instrument belong together when they lie within this time
/// [s] of each other.
inline constexpr double kMatchWindow_s = 0.030;
/// A contact goes at least so deep; the next can come once the tip has been so far outside.
inline constexpr double kContactDepth_m = 0.003, kRearm_m = 0.003;

/// Errors of a note's strike against the contact that it belongs to, apart from its time.
struct StrikeDynamics {
    double speed_percent = 0;  ///< predicted over true normal speed, less 1
    double speed_db = 0;       ///< 20 log10 of that ratio
    double place_mm = 0;       ///< along the surface
};
/// None of a contact that does not go inwards.
[[nodiscard]] std::optional<StrikeDynamics> dynamics_of(const Strike& strike, const TrueContact& contact);

/// How the notes of a run compare with the true contacts.
struct StrikeScore {
    int true_contacts = 0, released = 0, cancelled = 0, moved = 0, false_notes = 0, missed = 0;
    int false_turned_early =
        0;  ///< false notes whose true path turned back at least 25 ms before the release point
    int false_turned_late = 0;  ///< the other false notes
    /// Of |onset - true contact| over the matched notes; kNoValue when none matched.
    double timing_median_ms = kNoValue, timing_p95_ms = kNoValue;
    /// Of the absolute values in their StrikeDynamics; kNoValue likewise.
    double speed_median_percent = kNoValue, speed_p95_percent = kNoValue, speed_median_db = kNoValue,
           speed_p95_db = kNoValue, place_median_mm = kNoValue, place_p95_mm = kNoValue;
};

/// Compares the released notes with the true contacts: closest pairs first (equally close ones by contact
/// time, then by id), each note and each contact used once. Fills matched_id of every contact (0: missed) and
/// counts
///   moved   released strikes with moves > 0
///   false   released strikes without a contact
///   missed  contacts without a released strike
///   timing  median and p95 of |onset - contact| [ms] over the matched notes; kNoValue when nothing matched
///   speed   likewise of the strike's normal speed against the contact's, in % and dB; place likewise [mm]
/// The false_turned_* counts are left at 0: they need the recorded path.
/// `contacts` must be sorted by time. A pure function of its input; O((n + m) log n) for n contacts and m
/// strikes that are not denser than a few in the window.
[[nodiscard]] StrikeScore score_strikes(const std::vector<Strike>& strikes,
                                        std::vector<TrueContact>& contacts);

/// Contacts of the measured tip paths, straight between samples, with the instruments at rest, for scoring
/// only: the tip's centre enters the rest surface grown by the tip's radius in a zone that sounds and goes at
/// least 3 mm deep; armed again 3 mm outside. Not armed inside at the first sample or after a gap of more
/// than tracking::kGapS. The speed is that of the piece before the contact, which holds no rebound, or of the
/// piece that holds the contact where that is faster (a stroke that still accelerates). By time.
[[nodiscard]] std::vector<TrueContact> find_true_contacts(std::span<const TipTrack> tracks,
                                                          std::span<const sim::BodyDefinition> bodies,
                                                          double tip_radius_m);

/// The same for a horizontal plane that lies under everything: the tip's centre falls through `height_m`.
[[nodiscard]] std::vector<TrueContact> find_plane_contacts(const TipTrack& track, double height_m);

/// Contacts of a predicted path with that plane, by time: each fall through it, of the cubic pieces between
/// the nodes, that does not turn back less than 3 mm below; the path's first time if the tip starts below.
/// One body (0) with one zone (0).
[[nodiscard]] std::vector<sim::Contact> plane_contacts(const sim::TipPath& path, double height_m);

/// Counts the false notes whose stick had turned back 25 ms or more before the release point, and the others
/// (StrikeScore::false_turned_*). The turn is the measured tip's nearest approach to the instrument between
/// 0.1 s before the note's scheduling and a release margin after its onset.
void count_turns(StrikeScore& score, std::span<const Strike> strikes, std::span<const TrueContact> contacts,
                 std::span<const TipTrack> tracks, std::span<const sim::BodyDefinition> bodies,
                 double tip_radius_m, double release_margin_s);

}  // namespace app
