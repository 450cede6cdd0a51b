#include "scene/scene_bodies.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>

namespace app {
namespace {

/// Colours of bodies that name none: one a kind, or one a copy of a grid.
const std::array<Eigen::Vector3f, 8> kPalette = {Eigen::Vector3f(0.55f, 0.05f, 0.03f),
                                                 {0.62f, 0.25f, 0.02f},
                                                 {0.03f, 0.15f, 0.32f},
                                                 {0.05f, 0.22f, 0.08f},
                                                 Eigen::Vector3f(0.55f, 0.40f, 0.06f),
                                                 {0.20f, 0.06f, 0.22f},
                                                 {0.42f, 0.40f, 0.36f},
                                                 {0.03f, 0.24f, 0.24f}};

/// The named material; without a name the defaults of its keys.
SceneMaterial material_of(const BodyDraft& draft, const SceneMaterials& materials, const Fields& at) {
    if (!draft.material) return {};
    std::string known;
    for (const auto& entry : materials) known += (known.empty() ? "" : ", ") + entry.first;
    const auto found = materials.find(*draft.material);
    at.require(found != materials.end(), "material", fmt::format("material = \"{}\"", *draft.material),
               known.empty() ? "a table [material.NAME] of that name"
                             : fmt::format("one of {} or a table [material.{}]", known, *draft.material));
    return found->second;
}

/// [0, 1), the same on every library.
double uniform(std::mt19937_64& random) {
    return double(random() >> 11) * 0x1p-53;
}

/// Uniform over all orientations (Shoemake 1992).
Eigen::Quaterniond any_turn(std::mt19937_64& random) {
    const double u = uniform(random), a = 2 * std::numbers::pi * uniform(random),
                 b = 2 * std::numbers::pi * uniform(random);
    return {std::sqrt(u) * std::cos(b), std::sqrt(1 - u) * std::sin(a), std::sqrt(1 - u) * std::cos(a),
            std::sqrt(u) * std::sin(b)};
}

/// Centred about the body's own position.
std::vector<sim::WorldBody> copies(const sim::WorldBody& body, const BodyGrid& grid) {
    std::vector<sim::WorldBody> result;
    std::mt19937_64 random(std::uint64_t(grid.seed));
    const auto [nx, ny, nz] = grid.count;
    const Eigen::Vector3d middle = 0.5 * Eigen::Vector3d(nx - 1, 0, nz - 1);
    for (int k = 0; k < nx * ny * nz; ++k) {
        const Eigen::Vector3d at = Eigen::Vector3i(k % nx, k / nx % ny, k / nx / ny).cast<double>();
        sim::WorldBody copy = body;
        copy.name = fmt::format("{}/{}", body.name, k);
        Eigen::Vector3d away;
        for (double& value : away.reshaped()) value = grid.jitter_m * (2 * uniform(random) - 1);
        copy.world_from_body.translation() += grid.step.cwiseProduct(at - middle) + away;
        if (grid.turned) copy.world_from_body.linear() = any_turn(random).toRotationMatrix();
        result.push_back(copy);
    }
    return result;
}

}  // namespace

std::vector<sim::WorldBody> bodies_of(const BodyDraft& draft, const SceneMaterials& materials,
                                      const Fields& at) {
    const SceneMaterial m = material_of(draft, materials, at);
    sim::WorldBody body = draft.body;
    body.material = m.material;
    body.damping_alpha = m.damping_alpha, body.damping_beta = m.damping_beta;
    body.damping_ratio = m.damping_ratio;
    return draft.grid ? copies(body, *draft.grid) : std::vector{body};
}

render::Appearance look_of(const BodyDraft& draft, std::size_t kind, std::size_t k) {
    render::Appearance look = draft.look;
    look.color = draft.color.value_or(kPalette[(kind + k) % kPalette.size()]);
    return look;
}

}  // namespace app
