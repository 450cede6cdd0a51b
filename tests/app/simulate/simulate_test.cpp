#include "simulate/simulate.h"

#include <gtest/gtest.h>
#include <render/renderer.h>
#include <sim/surface_mesh.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "pictures/scene_stage.h"
#include "scene/scene.h"
#include "temporary_folder.h"
#include "written_scene.h"

namespace app {
namespace {

using Eigen::Vector3d;
using nlohmann::json;

SimulateOptions steps_of(const WrittenScene& scene, std::uint64_t steps) {
    SimulateOptions options;
    options.scene = scene.file();
    options.steps = steps;
    return options;
}

const std::string kFalling =
    "[[body]]\nname = \"ball\"\nradius = 0.5\nfidelity = \"rigid\"\nposition = [0, 10, 0]\nvelocity = [1, 0, "
    "0]\n";

/// Rows of a CSV text, split at commas.
std::vector<std::vector<std::string>> rows_of(const std::filesystem::path& file) {
    std::ifstream in(file);
    std::vector<std::vector<std::string>> rows;
    for (std::string line; std::getline(in, line);) {
        rows.emplace_back();
        std::istringstream cells(line);
        for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(cell);
    }
    return rows;
}

TEST(Simulate, AFallingBodyKeepsItsEnergyAndItsMomentumGrowsByItsWeight) {
    const SimulateResult r = simulate(steps_of(WrittenScene(kFalling), 60));
    EXPECT_EQ(r.steps, 60u);
    EXPECT_NEAR(r.time_s, 1, 1e-12);
    EXPECT_EQ(r.rigid, 1);
    // Substeps of a parabola: at most g h v a substep apart, 2e-4 of m g h with h = 1/240 s.
    EXPECT_NEAR(r.energy.total() / r.energy_start.total(), 1, 5e-3);
    ASSERT_TRUE(r.drift);
    EXPECT_LT(r.drift->linear, 1e-9 * r.drift->scale);
    const double mass = r.momentum.x();  // at 1 m/s
    EXPECT_NEAR(r.momentum.y() / mass, -9.81, 1e-9);
}

TEST(Simulate, BodiesThatCollideInFreeSpaceKeepTheirMomentum) {
    const WrittenScene scene(
        "[settings]\ngravity = [0, 0, 0]\n[defaults]\nfidelity = \"modal\"\n"
        "[[body]]\nname = \"a\"\nradius = 0.5\nposition = [-0.8, 0.1, 0]\nvelocity = [2, 0, 0]\n"
        "[[body]]\nname = \"b\"\nsize = [0.8, 1, 1.2]\nposition = [0.8, 0, 0]\nvelocity = [-1, 0, 0]\n");
    const SimulateResult r = simulate(steps_of(scene, 120));
    ASSERT_TRUE(r.drift);
    // The law is the world's to keep (1e-8 here); the figure would be 0.1 and more if a body were left out.
    EXPECT_LT(r.drift->linear, 1e-6 * r.drift->scale);
    EXPECT_EQ(r.modal, 2);
    const double relative = json::parse(format_simulate(r))["momentum_drift"];
    EXPECT_LT(relative, 1e-6);
    EXPECT_LT(r.energy.total(), r.energy_start.total());  // the collision was there
}

TEST(Simulate, WhereAFloorActsMomentumIsHeldAgainstTheImpulseThatItGave) {
    const SimulateResult r = simulate(steps_of(WrittenScene(kFalling + "[[plane]]\n"), 120));
    EXPECT_GT(r.momentum.y(), -0.7 * r.drift->scale) << "it has met the floor";
    ASSERT_TRUE(r.drift);
    EXPECT_LT(r.drift->linear, 1e-9 * r.drift->scale);  // rounding over 120 steps
    EXPECT_TRUE(json::parse(format_simulate(r))["angular_momentum_drift_kg_m2_s"].is_null());
}

TEST(Simulate, ABodyThatComesBringsItsMomentum) {
    const SimulateResult r = simulate(
        steps_of(WrittenScene(kFalling + "[[plane]]\n[[event]]\nstep = 5\nadd = { name = \"late\", radius "
                                         "= 0.3, position = [5, 9, 0], velocity = [0, 0, 3] }\n"),
                 30));
    ASSERT_TRUE(r.drift);
    EXPECT_LT(r.drift->linear, 1e-9 * r.drift->scale);
}

TEST(Simulate, JsonHasTheKeysThatScriptsRelyOn) {
    const json r = json::parse(format_simulate(simulate(steps_of(WrittenScene(kFalling), 7))));
    for (const char* key : {"scene", "bodies", "steps", "dt_s", "workers", "bound", "elapsed_s", "cpu_s",
                            "ns_per_body_step", "bytes_per_body_update", "cross_worker_contacts",
                            "migrations", "bodies_lost", "state_hash", "momentum_drift", "energy_j"})
        EXPECT_TRUE(r.contains(key)) << key;
    EXPECT_EQ(r["steps"], 7);
    EXPECT_EQ(r["dt_s"].get<double>(), 1.0 / 60);
    EXPECT_EQ(r["state_hash"].get<std::string>().size(), 16u);
}

TEST(Simulate, TheSameSceneGivesTheSameStateAndAnotherStepAnother) {
    const WrittenScene scene(
        "[box]\nsize = [4, 4]\n[[body]]\nname = \"b\"\nradius = 0.5\nfidelity = \"modal\"\n"
        "position = [0, 1, 0]\ngrid = { count = [2, 2, 2], step = [1.1, 1.1, 1.1], jitter = 0.04 }\n");
    SimulateOptions options = steps_of(scene, 60);
    const SimulateResult first = simulate(options), second = simulate(options);
    EXPECT_EQ(first.state_hash, second.state_hash);
    options.dt_s = 1.0 / 50;
    EXPECT_NE(simulate(options).state_hash, first.state_hash);
    options = steps_of(scene, 61);
    EXPECT_NE(simulate(options).state_hash, first.state_hash);
}

TEST(Simulate, LengthComesFromStepsThenSecondsThenTheScene) {
    const WrittenScene scene("[settings]\nseconds = \"1/3\"\n" + kFalling);
    SimulateOptions options;
    options.scene = scene.file();
    EXPECT_EQ(simulate(options).steps, 20u);
    options.seconds = 0.1;
    EXPECT_EQ(simulate(options).steps, 6u);
    options.steps = 4;
    EXPECT_EQ(simulate(options).steps, 4u);
}

TEST(Simulate, ADeletedConstraintLetsItsBodyFallFromThatStepOn) {
    const TemporaryFolder out;
    const WrittenScene scene(
        "[settings]\nsleeping = false\n[[body]]\nname = \"b\"\nradius = 0.5\nfidelity = \"rigid\"\n"
        "position = [0, 5, 0]\n[[constraint]]\nname = \"hook\"\nbody = \"b\"\npoint = [0, 0.5, 0]\n"
        "stiffness = 1e6\n[[event]]\ntime = 1\ndelete = \"hook\"\n");
    SimulateOptions options = steps_of(scene, 90);
    options.out = out.path() / "run";
    options.fps = 60;
    const SimulateResult r = simulate(options);
    EXPECT_TRUE(r.notes.empty());
    const auto rows = rows_of(*options.out / "states.csv");
    ASSERT_EQ(rows.size(), 92u);  // header, the start, and after each step
    const auto height = [&](std::size_t step) { return std::stod(rows[step + 1][4]); };
    EXPECT_NEAR(height(60), 5, 0.01);                               // m g / k = 3 mm of spring
    EXPECT_NEAR(height(60) - height(90), 0.5 * 9.81 * 0.25, 0.03);  // half a second, substeps of 1/240 s
    EXPECT_LT(height(61), height(60));
}

TEST(Simulate, ABodyThatComesLaterIsThereFromItsStepOnAndNotDrawnBefore) {
    const TemporaryFolder out;
    const WrittenScene scene(
        kFalling +
        "[[event]]\nstep = 10\nadd = { name = \"late\", radius = 0.3, fidelity = \"modal\", "
        "position = [0, 2, 0] }\nslow = { worker = 1, factor = 2 }\n");
    SimulateOptions options = steps_of(scene, 20);
    options.out = out.path() / "run";
    options.fps = 60;
    const SimulateResult r = simulate(options);
    EXPECT_EQ(r.bodies, 2);
    EXPECT_EQ(r.body_steps, 30u);
    ASSERT_EQ(r.notes.size(), 1u);
    EXPECT_NE(r.notes[0].find("worker 1"), std::string::npos);
    // A header; alone at steps 0 to 9; both from 10, before which it comes, to 20.
    EXPECT_EQ(rows_of(*options.out / "states.csv").size(), 1u + 10 + 2 * 11);

    const Scene read = scene.read();
    sim::World world(read.world);
    const SceneStage stage(read, world);
    EXPECT_EQ(stage.frame(world).visible, (std::vector<bool>{true, false}));
    (void)world.add_body(read.later[0]);
    const render::FrameState frame = stage.frame(world);
    EXPECT_EQ(frame.visible, (std::vector<bool>{true, true}));
    EXPECT_NEAR(frame.world_from_object[1](1, 3), 2, 1e-6);
    EXPECT_EQ(frame.modal[1].size(), world.state(1).q.size());
}

TEST(Simulate, UntilRestStopsWhenAllSleepAndSaysWhenTheyDoNot) {
    const WrittenScene scene(
        "[[plane]]\n[[body]]\nname = \"b\"\nsize = [1, 0.4, 1]\nexponents = [0.2, 0.2]\nfidelity = "
        "\"rigid\"\nposition = [0, 0.25, 0]\n[[event]]\ntime = 2\nadd = { name = \"c\", size = [1, 0.4, "
        "1], exponents = [0.2, 0.2], fidelity = \"rigid\", position = [3, 0.25, 0] }\n");
    SimulateOptions options;
    options.scene = scene.file();
    options.until_rest = true;
    const SimulateResult r = simulate(options);
    EXPECT_TRUE(r.rest_reached);
    EXPECT_GT(r.steps, 120u);  // not before the event
    EXPECT_LT(r.steps, 600u);
    EXPECT_EQ(r.counts.asleep, 2);
    options.steps = 60;
    EXPECT_FALSE(simulate(options).rest_reached);
}

TEST(Simulate, TheFigureAndTheLatticeRestBeforeAndAfterTheirConstraintsAreDeleted) {
    struct Case {
        const char* name;
        std::uint64_t before;  // the last step before the event
        int bodies;
    };
    for (const Case& c : {Case{"human", 299, 10}, Case{"lattice", 719, 25}}) {
        SimulateOptions options;
        options.scene = find_scene(c.name);
        options.steps = c.before;
        const SimulateResult first = simulate(options);
        EXPECT_EQ(first.counts.asleep, c.bodies) << c.name << " hangs at rest";
        options.steps.reset();
        options.until_rest = true;
        const SimulateResult second = simulate(options);
        EXPECT_TRUE(second.rest_reached) << c.name;
        EXPECT_GT(second.steps, c.before);
        EXPECT_EQ(second.counts.asleep, c.bodies);
        EXPECT_LT(second.energy.potential, first.energy.potential) << "it has come down";
        EXPECT_EQ(second.mishaps.quarantined.size(), 0u);
    }
}

TEST(Simulate, TablesGoOnForEveryStepAndReadBackExactly) {
    const TemporaryFolder out;
    const WrittenScene scene(kFalling);
    SimulateOptions options = steps_of(scene, 12);
    options.out = out.path() / "run";
    const SimulateResult r = simulate(options);
    const auto energy = rows_of(*options.out / "energy.csv"), times = rows_of(*options.out / "times.csv"),
               states = rows_of(*options.out / "states.csv");
    ASSERT_EQ(energy.size(), 14u);
    EXPECT_EQ(std::stod(energy.back()[2]), r.energy.kinetic);
    EXPECT_EQ(std::stod(energy.back()[7]), r.momentum.y());
    EXPECT_EQ(times.size(), 13u);
    ASSERT_EQ(states.size(), 8u);  // 30 a second of 0.2 s, both ends
    EXPECT_NEAR(std::stod(states.back()[3]), 0.2, 1e-12);
    std::ifstream summary(*options.out / "summary.json");
    EXPECT_EQ(json::parse(summary)["steps"], 12);
}

/// The step is as long as a frame: the moments of an exposure lie between two states.
TEST(Simulate, MotionBlurDrawsTheWayOfWhatMovesAndChangesNoTable) {
    const TemporaryFolder out;
    const WrittenScene scene("[settings]\ndt = 0.03333333333333333\n" + kFalling);
    const auto ran = [&](const char* name, double shutter) {
        SimulateOptions options = steps_of(scene, 6);
        options.out = out.path() / name;
        options.frames = true, options.width = 64, options.height = 48, options.shutter = shutter;
        EXPECT_EQ(simulate(options).frames, 7u);
        return *options.out;
    };
    const auto bytes = [](const std::filesystem::path& file) {
        std::ifstream in(file, std::ios::binary);
        return std::string(std::istreambuf_iterator<char>(in), {});
    };
    const std::filesystem::path sharp = ran("sharp", 0), blurred = ran("blurred", 0.5);
    for (const char* table : {"states.csv", "energy.csv"})
        EXPECT_EQ(bytes(sharp / table), bytes(blurred / table));
    EXPECT_EQ(bytes(sharp / "frames/000000.png"), bytes(blurred / "frames/000000.png"))
        << "nothing was before";
    EXPECT_NE(bytes(sharp / "frames/000006.png"), bytes(blurred / "frames/000006.png"));
}

/// Where the stage puts a vertex of a body's mesh, as the vertex shader does.
Vector3d drawn(const render::Solid& solid, const render::FrameState& frame, std::size_t object,
               std::size_t vertex) {
    Eigen::Vector3f at = solid.mesh.parts[0].positions[vertex];
    for (int k = 0; k < solid.modes.count; ++k)
        at += frame.modal[object][k] *
              solid.modes.displacement[vertex * std::size_t(solid.modes.count) + std::size_t(k)];
    return (frame.world_from_object[object] * at.homogeneous()).head<3>().cast<double>();
}

TEST(SceneStage, DeformedBodiesOfAllFidelitiesAreDrawnWhereTheirMatterIs) {
    const Scene scene =
        WrittenScene(
            "[room]\nscale = 0.5\n[defaults]\nsize = [0.6, 0.4, 0.5]\nexponents = [0.7, 1.2]\n"
            "tilt_deg = [10, 20, 30]\n"
            "[[body]]\nname = \"r\"\nfidelity = \"rigid\"\n"
            "[[body]]\nname = \"l\"\nfidelity = \"linear\"\nposition = [1, 1, 0]\n"
            "[[body]]\nname = \"m\"\nfidelity = \"modal\"\nposition = [2, 1, 1]\n")
            .read();
    sim::World world(scene.world);
    for (const int body : {1, 2}) {
        sim::WorldBodyState state = world.state(body);
        for (int k = 0; k < state.q.size(); ++k)
            state.q[k] = 0.02 * (k + 1) / (1 + 0.3 * k) * (k % 2 ? -1 : 1);
        world.set_state(body, state);
    }
    const SceneStage stage(scene, world);
    const render::SceneDescription description = stage.description(64, 48);
    const render::FrameState frame = stage.frame(world);
    for (int body = 0; body < 3; ++body) {
        const auto b = static_cast<std::size_t>(body);
        const sim::WorldBodyState state = world.state(body);
        const sim::SurfaceMesh mesh = sim::surface_mesh(scene.world.bodies[b].shape, 360);
        const render::Solid& solid = description.solids[std::size_t(description.objects[b].solid)];
        double bent = 0;
        for (std::size_t v = 0; v < solid.mesh.parts[0].positions.size(); ++v) {
            Vector3d r = mesh.vertices[v];
            if (body > 0) {
                const Eigen::VectorXd nodal = world.basis(body).nodal * state.q;
                const Vector3d u = sim::displacement_at(world.basis(body), nodal, r).value;
                bent = std::max(bent, u.norm());
                r += u;
            }
            const Vector3d expected = 0.5 * (state.position + state.orientation * r);
            EXPECT_LT((drawn(solid, frame, b, v) - expected).norm(), 2e-6) << body;  // floats
        }
        EXPECT_TRUE(body == 0 || bent > 0.001) << body << ' ' << bent;
    }
}

}  // namespace
}  // namespace app
