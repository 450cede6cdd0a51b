#pragma once
#include <filesystem>
#include <vector>

#include "kit/kit.h"
#include "kit/stick_geometry.h"
#include "play/play_options.h"

namespace app {

/// True contacts of the recorded paths (PlayResult::tracks), and how the notes compare with them.
void score(PlayResult& result, const Kit& kit, const StickGeometry& stick);
/// The released notes as a MIDI file.
void write_hits(const std::filesystem::path& file, const PlayResult& result, const Kit& kit);
/// Frames for the report: before, at and after the two loudest notes that lie apart.
[[nodiscard]] std::vector<std::filesystem::path> frames_to_show(const PlayResult& result,
                                                                const std::filesystem::path& folder);
}  // namespace app
