#pragma once
#include <string>
#include <string_view>

#include "play/play_result.h"

namespace app {

/// Text of events.csv: a row for every note that was scheduled, by id. Columns
///   id,stick,instrument,onset_s,speed_mps,px,py,pz,scheduled_at_s,outcome,moves,decided_at_s,model
/// stick and instrument by name; onset_s, scheduled_at_s and decided_at_s on the trace's clock [s]; px,py,pz
/// the struck point on the surface [m], world; outcome released|cancelled; model the predictor that played
/// it. Throws std::logic_error for a strike that is still pending: every note of a finished run was decided.
[[nodiscard]] std::string format_events(const PlayResult& result);

/// Text of contacts.csv: a row for every true contact, by time. Columns
///   t,stick,instrument,speed_mps,px,py,pz,matched_id
/// px,py,pz the centre of the tip [m]; matched_id the note that sounded it, 0 for a missed one.
[[nodiscard]] std::string format_contacts(const PlayResult& result);

// Both tables: numbers read back to the same double; a name that holds a comma, a quote or a line break is
// quoted (RFC 4180); lines end in "\n".

}  // namespace app
