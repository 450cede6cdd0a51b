#include "scene/scene_bodies.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "scene/look_tables.h"

namespace app {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// Colours of bodies that name none: one a kind, or one a copy of a grid.
const std::array<Eigen::Vector3f, 8> kPalette = {Eigen::Vector3f(0.55f, 0.05f, 0.03f),
                                                 {0.62f, 0.25f, 0.02f},
                                                 {0.03f, 0.15f, 0.32f},
                                                 {0.05f, 0.22f, 0.08f},
                                                 Eigen::Vector3f(0.55f, 0.40f, 0.06f),
                                                 {0.20f, 0.06f, 0.22f},
                                                 {0.42f, 0.40f, 0.36f},
                                                 {0.03f, 0.24f, 0.24f}};

SceneMaterial read_material(TomlReader reader) {
    SceneMaterial m;
    m.material.young_pa = reader.number("young_pa", 1e2, 1e13, m.material.young_pa);
    m.material.poisson = reader.number("poisson", -0.9, 0.495, m.material.poisson);
    m.material.density_kg_m3 = reader.number("density_kg_m3", 1, 1e5, m.material.density_kg_m3);
    m.damping_alpha = reader.number("damping_alpha", 0, 1e6, m.damping_alpha);
    m.damping_beta = reader.number("damping_beta", 0, 1e3, m.damping_beta);
    m.damping_ratio = reader.number("damping_ratio", 0, 10, m.damping_ratio);
    reader.done();
    return m;
}

/// `size` (full extents) or `radius`.
Eigen::Vector3d read_semi_axes(TomlReader& reader) {
    if (reader.has("radius") && reader.has("size"))
        reader.fail("radius", "both radius and size", "one of them");
    const double radius = reader.number("radius", 0.0005, 50, 0.0);
    const Eigen::Vector3d size = reader.vector(
        "size", 0.001, 100,
        radius > 0 ? std::optional(Eigen::Vector3d::Constant(2 * radius).eval()) : std::nullopt);
    return 0.5 * size;
}

std::vector<sim::Bump> read_bumps(TomlReader& reader, const Eigen::Vector3d& semi_axes) {
    std::vector<sim::Bump> bumps;
    const double size = semi_axes.maxCoeff();
    for (TomlReader& entry : reader.tables("bumps")) {
        sim::Bump bump;
        bump.direction = entry.vector("direction", -kFarM, kFarM);
        if (bump.direction.norm() < 1e-6) entry.fail("direction", "direction = [0, 0, 0]", "a direction");
        bump.height_m = entry.number("height", -0.5 * size, 2 * size);
        bump.width_rad = kDegree * entry.number("width_deg", 1, 90, bump.width_rad / kDegree);
        entry.done();
        bumps.push_back(bump);
    }
    return bumps;
}

sim::FidelityRequest read_fidelity(TomlReader& reader) {
    sim::FidelityRequest request;
    const std::string word =
        reader.choice("fidelity", {"rigid", "linear", "modal", "automatic"}, "automatic");
    request.fidelity = word == "rigid"    ? sim::Fidelity::rigid
                       : word == "linear" ? sim::Fidelity::linear
                       : word == "modal"  ? sim::Fidelity::modal
                                          : sim::Fidelity::automatic;
    request.modes = reader.integer("modes", 1, 120, request.modes);
    request.elements = reader.integer("elements", 1, 4, request.elements);
    const int nodes = 2 * request.elements + 1, most = 3 * nodes * nodes * nodes - 6;
    if (request.modes > most)
        reader.fail("modes", fmt::format("modes = {}", request.modes),
                    fmt::format("at most {}, as many as elements = {} has", most, request.elements));
    request.domain = reader.choice("domain", {"superquadric", "box"}, "superquadric") == "box"
                         ? sim::ModeDomain::box
                         : sim::ModeDomain::superquadric;
    request.error = reader.number("error", 1e-6, 1, request.error);
    request.impact_mps = reader.number("impact", 0.01, 1000, request.impact_mps);
    return request;
}

void read_matter(TomlReader& reader, const SceneMaterials& materials, sim::WorldBody& body) {
    const std::string name = reader.text("material", "");
    SceneMaterial m;
    if (const auto found = materials.find(name); found != materials.end()) {
        m = found->second;
    } else if (reader.has("material")) {
        std::string known;
        for (const auto& entry : materials) known += (known.empty() ? "" : ", ") + entry.first;
        reader.fail("material", fmt::format("material = \"{}\"", name),
                    known.empty() ? "a table [material.NAME] of that name"
                                  : fmt::format("one of {} or a table [material.{}]", known, name));
    }
    body.material = m.material;
    body.damping_alpha = m.damping_alpha, body.damping_beta = m.damping_beta;
    body.damping_ratio = m.damping_ratio;
}

struct Grid {
    std::array<int, 3> count{1, 1, 1};
    Eigen::Vector3d step = Eigen::Vector3d::Zero();
    double jitter_m = 0;
    bool turned = false;
    int seed = 1;
};

Grid read_grid(TomlReader reader) {
    Grid grid;
    const Eigen::Vector3d count = reader.vector("count", 1, double(kMostBodies));
    for (int i = 0; i < 3; ++i) grid.count[std::size_t(i)] = int(count[i]);
    if (count != count.array().floor().matrix() || count.prod() > double(kMostBodies))
        reader.fail("count", "a count that is not whole or too large",
                    fmt::format("[x, y, z] copies, {} at most in all", kMostBodies));
    grid.step = reader.vector("step", -kFarM, kFarM);
    grid.jitter_m = reader.number("jitter", 0, kFarM, 0.0);
    grid.turned = reader.flag("turned", false);
    grid.seed = reader.integer("seed", 0, 1 << 30, 1);
    reader.done();
    return grid;
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
std::vector<sim::WorldBody> copies(const sim::WorldBody& body, const Grid& grid) {
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

sim::WorldBody read_body(TomlReader& reader, const SceneMaterials& materials) {
    sim::WorldBody body;
    body.name = reader.text("name");
    if (body.name.empty()) reader.fail("name", "name = \"\"", "a name");
    body.shape.base.semi_axes = read_semi_axes(reader);
    const Eigen::VectorXd exponents =
        reader.numbers("exponents", 2, 0.1, 1.9, Eigen::VectorXd(Eigen::Vector2d(1, 1)));
    body.shape.base.e1 = exponents[0], body.shape.base.e2 = exponents[1];
    body.shape.bumps = read_bumps(reader, body.shape.base.semi_axes);
    read_matter(reader, materials, body);
    body.fidelity = read_fidelity(reader);
    body.triangles = reader.integer("triangles", 48, 20000, body.triangles);
    body.friction = reader.number("friction", 0, 10, body.friction);
    body.restitution = reader.number("restitution", 0, 1, body.restitution);
    body.fixed = reader.flag("fixed", false);
    body.gravity_scale = reader.number("gravity_scale", -10, 10, 1.0);
    body.world_from_body.translation() = reader.vector("position", -kFarM, kFarM, Eigen::Vector3d(0, 0, 0));
    body.world_from_body.linear() = read_orientation(reader).toRotationMatrix();
    body.velocity = reader.vector("velocity", -kFarM, kFarM, Eigen::Vector3d(0, 0, 0));
    body.angular_velocity = reader.vector("spin", -kFarM, kFarM, Eigen::Vector3d(0, 0, 0));
    return body;
}

}  // namespace

SceneMaterials read_materials(const toml::table& scene) {
    SceneMaterials materials;
    TomlReader top({&scene}, "the scene");
    TomlReader all = top.table("material");
    const toml::table* table = scene["material"].as_table();
    if (!table) return materials;
    for (const auto& [key, node] : *table) {
        const std::string name(key.str());
        materials[name] = read_material(all.table(name));
    }
    return materials;
}

ReadBodies read_bodies(const toml::table& table, const toml::table* defaults, const SceneMaterials& materials,
                       std::size_t kind) {
    std::vector<const toml::table*> layers = {&table};
    if (defaults) layers.push_back(defaults);
    const toml::node* named = table.get("name");
    const std::string name = named && named->is_string() ? named->as_string()->get() : "";
    TomlReader reader(layers, name.empty() ? "a body" : fmt::format("body \"{}\"", name.substr(0, 60)));
    const sim::WorldBody body = read_body(reader, materials);
    const bool copied = reader.has("grid");
    TomlReader grid = reader.table("grid");
    TomlReader looks = reader.table("look");
    const bool coloured = looks.has("color");
    const render::Appearance look = read_appearance(std::move(looks));
    reader.done();

    ReadBodies result;
    result.bodies = copied ? copies(body, read_grid(std::move(grid))) : std::vector{body};
    for (std::size_t k = 0; k < result.bodies.size(); ++k) {
        result.looks.push_back(look);
        if (!coloured) result.looks.back().color = kPalette[(kind + k) % kPalette.size()];
    }
    return result;
}

}  // namespace app
