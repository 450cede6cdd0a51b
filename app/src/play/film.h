#pragma once
#include <render/scene.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>

#include "play/play.h"

namespace app {

/// Of 000012.png 12.
[[nodiscard]] std::uint64_t frame_number(const std::filesystem::path& file);

/// Returns when the file is there, with its picture if that is at hand; else it is read from the file.
using PictureOf = std::function<std::optional<render::Image>(const std::filesystem::path& file)>;

/// The frames of a film side by side, each `width` pixels wide (as wide as it is, if narrower), with a bar
/// below that tells how far it has come and when the stroke sounds. Frames that are not there show the one
/// before. No frames: an empty picture. Throws std::runtime_error.
[[nodiscard]] render::Image film_strip(const Film& film, int width, const PictureOf& picture_of);

/// A smaller picture: the mean of what falls into each pixel.
[[nodiscard]] render::Image scaled_down(const render::Image& image, int width, int height);

}  // namespace app
