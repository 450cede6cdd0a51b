#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>

#include "bench/hard_watch.h"
#include "commands/bench_options.h"
#include "files/assets.h"
#include "scene/scene.h"

// The bundled hard scenes over size, speed, step and fidelity: nothing falls through, is thrown by what it misses, gains
// energy or is taken out.
//
// A scene of another size is the same at Froude's scale: gravity and densities stay, lengths grow by s, times and
// speeds by sqrt(s), stiffnesses of joints by s^2 and Young's moduli by s, so what is right stays right. The step does
// not grow: it is swept by itself. Where a scene flies, falls or spins at a speed, that is swept instead, and a flight
// lasts as long as its way takes.
//
// The whole grid with MUSICWORLD_LONG=1; else every kThinned-th case of each scene, in the order of the loops below,
// which comes to each value of each axis (kThinned has no divisor in common with their lengths), for at most kFewSteps.

namespace {

using app::HardFigures;
using sim::Fidelity;

constexpr std::array kSizes_m = {0.01, 0.1, 1.0, 10.0};  // largest extent of the smallest body that moves
constexpr std::array kSpeeds_mps = {1.0, 10.0, 100.0, 300.0};
constexpr std::array kSteps_per_s = {30, 60, 240, 480};
constexpr std::array kFidelities = {Fidelity::rigid, Fidelity::linear, Fidelity::modal};
constexpr int kThinned = 11, kFewSteps = 300;
constexpr double kLongest_s = 10;  // what gains of energy are judged over

constexpr double kMostGained = 1e-3;  // of what there is, see HardFigures
constexpr double kMostThrown = 0.01;  // of the radius of what flies past

struct Case {
    std::string scene;
    double size_m = 0;
    double speed_mps = 0;  ///< 0: the scene's
    int steps_per_s = 0;
    Fidelity fidelity = Fidelity::rigid;

    [[nodiscard]] std::string name() const {
        constexpr std::array kNames = {"rigid", "linear", "modal"};
        std::string text = fmt::format("{} {:g} m ", scene, size_m);
        if (speed_mps > 0) text += fmt::format("{:g} m/s ", speed_mps);
        return text + fmt::format("1/{} s {}", steps_per_s, kNames[static_cast<std::size_t>(fidelity)]);
    }
};

bool has_speed(const std::string& scene) {
    return scene == "ghost" || scene == "card_through_wall" || scene == "table" || scene == "top";
}

std::vector<Case> grid(const std::string& scene) {
    std::vector<double> speeds = {0};
    if (has_speed(scene)) speeds.assign(kSpeeds_mps.begin(), kSpeeds_mps.end());
    std::vector<Case> all;
    for (const double size : kSizes_m)
        for (const double speed : speeds)
            for (const int steps : kSteps_per_s)
                for (const Fidelity fidelity : kFidelities)
                    all.push_back({scene, size, speed, steps, fidelity});
    return all;
}

double extent(const sim::WorldBody& body) {
    return 2 * body.shape.base.semi_axes.maxCoeff();
}

double size_of(const sim::WorldDefinition& world) {
    double size = std::numeric_limits<double>::infinity();
    for (const sim::WorldBody& body : world.bodies)
        if (body.moves()) size = std::min(size, extent(body));
    return size;
}

/// The scene at Froude's scale `s`.
void scale(app::Scene& scene, app::HardScene& hard, double s) {
    for (sim::WorldBody& body : scene.world.bodies) {
        body.shape.base.semi_axes *= s, body.world_from_body.translation() *= s;
        body.material.young_pa *= s;
        body.velocity *= std::sqrt(s), body.angular_velocity /= std::sqrt(s);
    }
    for (sim::WorldPlane& plane : scene.world.planes) plane.offset *= s;
    for (sim::PointConstraint& joint : scene.world.constraints) {
        joint.point_a *= s, joint.point_b *= s;
        joint.stiffness *= s * s;
    }
    scene.seconds *= std::sqrt(s), hard.value *= s;
}

/// What moves does so at `speed` from the start on: as it flies, spins, or else downwards.
void set_speed(app::Scene& scene, double speed) {
    for (sim::WorldBody& body : scene.world.bodies) {
        if (!body.moves()) continue;
        if (body.velocity.norm() > 0) {
            scene.seconds *= body.velocity.norm() / speed;
            body.velocity *= speed / body.velocity.norm();
        } else if (body.angular_velocity.norm() > 0) {
            body.angular_velocity *= speed / (body.angular_velocity.norm() * extent(body) / 2);
        } else {
            body.velocity = speed * scene.world.settings.gravity.normalized();
        }
    }
}

HardFigures run(const Case& c, int most_steps) {
    app::Scene scene = app::read_scene(app::find_bundled("hard/" + c.scene, "scenes"));
    app::HardScene hard = *std::ranges::find(app::hard_scenes(), c.scene, &app::HardScene::name);
    scale(scene, hard, c.size_m / size_of(scene.world));
    if (c.speed_mps > 0) set_speed(scene, c.speed_mps);
    for (sim::WorldBody& body : scene.world.bodies) body.fidelity.fidelity = c.fidelity;
    const double dt = scene.world.settings.dt = 1.0 / c.steps_per_s;
    const int steps = std::min(
        most_steps, std::max(2, static_cast<int>(std::ceil(std::min(scene.seconds, kLongest_s) / dt))));
    app::HardWatch watch(scene.world, hard);
    sim::World world(scene.world);
    for (int k = 1; k <= steps; ++k) {
        world.step();
        if (!watch.look(k * dt, app::rigid_states(world), world.energy().total())) break;
    }
    return watch.figures(static_cast<int>(world.quarantined().size()));
}

class HardSweep : public testing::TestWithParam<std::string> {};

TEST_P(HardSweep, NothingFallsThroughIsThrownByWhatItMissesGainsEnergyOrIsTakenOut) {
    const bool whole = std::getenv("MUSICWORLD_LONG") != nullptr;
    const std::vector<Case> cases = grid(GetParam());
    for (std::size_t i = 0; i < cases.size(); i += whole ? 1 : kThinned) {
        const Case& c = cases[i];
        const HardFigures f = run(c, whole ? std::numeric_limits<int>::max() : kFewSteps);
        EXPECT_EQ(f.through, 0) << c.name();
        EXPECT_EQ(f.quarantined, 0) << c.name();
        EXPECT_LE(f.energy_gained, kMostGained) << c.name();
        // Lengths are shares of the diameter.
        if (c.scene == "ghost") {
            EXPECT_LE(2 * f.drift.value_or(0), kMostThrown) << c.name();
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Scenes, HardSweep, testing::ValuesIn(app::kHardSceneNames),
                         [](const auto& scene) { return scene.param; });

}  // namespace
