#pragma once
#include <sim/world.h>

#include <map>
#include <string>
#include <vector>

#include "files/toml_reader.h"
#include "scene/scene.h"

namespace app {

/// A material of a scene, with its damping.
struct SceneMaterial {
    sim::Material material;
    double damping_alpha = 0, damping_beta = 0, damping_ratio = 0.05;
};
using SceneMaterials = std::map<std::string, SceneMaterial>;

/// `[material.NAME]` tables.
[[nodiscard]] SceneMaterials read_materials(const toml::table& scene);

inline constexpr std::size_t kMostBodies = 10000;

/// One table of a body: one body, or the copies of its `grid`, named NAME/0, NAME/1, ... (x fastest, then y,
/// then z). Values that it leaves out come from `defaults` (may be null).
struct ReadBodies {
    std::vector<sim::WorldBody> bodies;
    std::vector<render::Appearance> looks;
};
[[nodiscard]] ReadBodies read_bodies(const toml::table& table, const toml::table* defaults,
                                     const SceneMaterials& materials, std::size_t kind);

}  // namespace app
