#pragma once
#include <filesystem>

namespace app {

/// Encodes the frames, and audio.wav if `sound`, of a staging folder beside the video's place, as
/// FILE.partial.
void make_video(const std::filesystem::path& video, double fps, bool sound,
                const std::filesystem::path& staging);

}  // namespace app
