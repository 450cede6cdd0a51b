#pragma once
#include <filesystem>
#include <vector>

#include "kit.h"
#include "play.h"
#include "tip_track.h"

namespace app {

/// True contacts of the recorded paths (PlayResult::tracks), and how the notes compare with them.
void score(PlayResult& result, const Kit& kit, const StickGeometry& stick);
/// The released notes as a MIDI file.
void write_hits(const std::filesystem::path& file, const PlayResult& result, const Kit& kit);
/// Frames for the report: before, at and after the two loudest notes that lie apart.
[[nodiscard]] std::vector<std::filesystem::path> frames_to_show(const PlayResult& result,
                                                                const std::filesystem::path& folder);
/// Encodes the frames, and audio.wav if `sound`, of a staging folder beside the video's place, as
/// FILE.partial.
void make_video(const std::filesystem::path& video, double fps, bool sound,
                const std::filesystem::path& staging);

}  // namespace app
