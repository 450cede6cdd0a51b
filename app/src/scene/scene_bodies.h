#pragma once
#include <vector>

#include "scene/scene_keys.h"

namespace app {

/// One table of a body: one body, or the copies of its `grid`, named NAME/0, NAME/1, ... (x fastest, then y,
/// then z). The name of its material must be among `materials`, or BadInput is thrown at the table's place.
[[nodiscard]] std::vector<sim::WorldBody> bodies_of(const BodyDraft& draft, const SceneMaterials& materials,
                                                    const Fields& at);

/// The look of copy k of a body of the given kind: bodies without a colour take one of eight.
[[nodiscard]] render::Appearance look_of(const BodyDraft& draft, std::size_t kind, std::size_t k);

}  // namespace app
