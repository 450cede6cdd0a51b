#pragma once
#include <sim/modal_body.h>
#include <sim/simulation.h>

#include <span>
#include <vector>

#include "kit/tip_track.h"
#include "strikes/score_strikes.h"

namespace app {

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
