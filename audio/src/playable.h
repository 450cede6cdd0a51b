#pragma once
#include <cmath>
#include <cstddef>

#include "audio/performance.h"

namespace audio {

/// Whether a note has an id and a voice, and its values are in range.
[[nodiscard]] inline bool is_playable(const Note& note, std::size_t voices) noexcept {
    return note.id != 0 && note.voice < voices && note.onset_sample >= 0 && std::isfinite(note.speed_mps) &&
           note.speed_mps >= 0 && note.place >= 0 && note.place <= 1 && note.zone >= 0 && note.pedal >= 0 &&
           note.pedal <= 1;
}

}  // namespace audio
