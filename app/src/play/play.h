#pragma once
#include <tracking/trace.h>

#include <vector>

#include "kit/kit.h"
#include "kit/stick_geometry.h"
#include "play/play_options.h"
#include "play/play_result.h"

namespace app {

/// Plays a recorded trace offline on a virtual clock into the folder `out`: frames/, audio.wav, events.csv,
/// contacts.csv, hits.mid, summary.json and report.html. Throws BadInput, tracking::TraceError or
/// std::invalid_argument for bad input and std::runtime_error for failures while running; then nothing that
/// looks finished is left in `out`.
PlayResult play(const PlayOptions& options);

/// The strikes of play(), by id, without frames and sound and in this process.
[[nodiscard]] std::vector<Strike> offline_strikes(const tracking::Trace& trace, const Kit& kit,
                                                  const PlayOptions& options, const StickGeometry& stick);

}  // namespace app
