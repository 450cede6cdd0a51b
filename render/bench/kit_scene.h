#pragma once
#include <string>

#include "render/scene.h"

namespace render_bench {

/// A kit to measure and to look at: five drums, three cymbals and their stands, a bell, two sticks; about
/// 15000 triangles.
[[nodiscard]] render::SceneDescription kit_scene(const std::string& meshes);
/// Its frame at a time [s]: the sticks swing at 2 Hz, the heads give a little.
[[nodiscard]] render::FrameState kit_frame(double time_s);

}  // namespace render_bench
