#pragma once
#include <render/scene.h>

#include <filesystem>
#include <functional>

#include "play/play.h"

namespace app {

using BeforeFrame = std::function<void(const std::filesystem::path& file)>;

/// The frames of a film side by side, each `width` pixels wide (as wide as it is, if narrower), with a bar
/// below that tells how far it has come and when the stroke sounds. Frames that are not there show the one
/// before. No frames: an empty picture. `before`, if there is one, is called with each file before it is
/// read. Throws std::runtime_error.
[[nodiscard]] render::Image film_strip(const Film& film, int width, const BeforeFrame& before = {});

/// A smaller picture: the mean of what falls into each pixel.
[[nodiscard]] render::Image scaled_down(const render::Image& image, int width, int height);

}  // namespace app
