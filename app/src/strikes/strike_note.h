#pragma once
#include <audio/performance.h>

#include "kit/kit.h"
#include "strikes/strike.h"

namespace app {

/// The note that sounds a strike: speed through the instrument's velocity curve, place within the struck
/// zone, MIDI note and velocity. MIDI velocity = 127 (v / 8 m/s)^0.7, held to 1..127.
[[nodiscard]] audio::Note note_of(const Strike& strike, const Instrument& instrument);

}  // namespace app
