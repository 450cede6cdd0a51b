#include "bench/bench_hard.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "app/temporary_folder.h"
#include "files/assets.h"
#include "scene/scene.h"

namespace {

using app::HardFigures;
using app::HardScene;
using app::HardWatch;
using app::Right;
using Eigen::Vector3d;
using sim_bench::RigidState;
using Json = nlohmann::json;

sim::WorldBody body_at(const Vector3d& position, const Vector3d& half, double exponent) {
    sim::WorldBody body;
    body.shape.base = {half, exponent, exponent};
    body.material = {1e9, 0.3, 1000};
    body.world_from_body.translation() = position;
    return body;
}
sim::WorldBody cube_at(const Vector3d& position) {
    return body_at(position, {0.5, 0.5, 0.5}, 0.1);
}
sim::WorldBody ball_at(const Vector3d& position) {
    return body_at(position, {0.5, 0.5, 0.5}, 1);
}

std::vector<RigidState> states_of(const sim::WorldDefinition& world) {
    std::vector<RigidState> all;
    for (const sim::WorldBody& b : world.bodies)
        all.push_back({b.world_from_body.translation(), Eigen::Quaterniond(b.world_from_body.linear()),
                       b.velocity, b.angular_velocity});
    return all;
}

/// What one look at these states says.
HardFigures seen(const sim::WorldDefinition& world, const std::vector<RigidState>& states, Right right,
                 double value = 0) {
    HardWatch watch(world, {"a scene", right, 0.01, value});
    (void)watch.look(1, states);
    return watch.figures(0);
}

TEST(HardWatch, BodiesAreAsDeepInEachOtherAsTheirShapesSay) {
    struct Case {
        const char* what;
        sim::WorldBody a, b;
        double depth;
    };
    sim::WorldBody turned = cube_at({0, 0.5 + std::sqrt(0.5) - 0.02, 0});
    turned.world_from_body.linear() = Eigen::AngleAxisd(M_PI / 4, Vector3d::UnitX()).toRotationMatrix();
    const Case cases[] = {{"two balls", ball_at({0, 0, 0}), ball_at({0.9, 0, 0}), 0.1},
                          {"balls apart", ball_at({0, 0, 0}), ball_at({1.1, 0, 0}), 0},
                          {"a ball on a face", cube_at({0, 0, 0}), ball_at({0.1, 0.95, 0.2}), 0.05},
                          {"a ball at a corner", ball_at({0.5 + 0.2, 0.5 + 0.2, 0.5 + 0.2}),
                           cube_at({0, 0, 0}), 0.5 - 0.2 * std::sqrt(3.0)},
                          {"a ball's centre inside", ball_at({0.4, 0, 0}), cube_at({0, 0, 0}), 0.6},
                          {"two cubes", cube_at({0, 0, 0}), cube_at({0.3, 0.97, 0}), 0.03},
                          {"an edge on a face", cube_at({0, 0, 0}), turned, 0.02}};
    for (const Case& c : cases) {
        sim::WorldDefinition world;
        world.bodies = {c.a, c.b};
        EXPECT_NEAR(seen(world, states_of(world), Right::rests).penetration, c.depth, 1e-12) << c.what;
    }
    sim::WorldDefinition world;
    world.planes.push_back({});
    world.bodies = {turned};
    world.bodies[0].world_from_body.translation().y() = 0.7;
    EXPECT_NEAR(seen(world, states_of(world), Right::rests).penetration, std::sqrt(0.5) - 0.7, 1e-12);
}

TEST(HardWatch, JoinedBodiesMayOverlapAndTheirGapIsMeasured) {
    sim::WorldDefinition world;
    world.bodies = {ball_at({0, 0, 0}), ball_at({0.8, 0, 0})};
    world.constraints.push_back({"joint", 0, {0.4, 0, 0}, 1, {-0.4, 0, 0}});
    std::vector<RigidState> states = states_of(world);
    states[1].position.x() += 0.25;
    const HardFigures f = seen(world, states, Right::gains_none);
    EXPECT_EQ(f.penetration, 0);
    EXPECT_NEAR(*f.joint_gap, 0.25, 1e-12);
    EXPECT_FALSE(f.drift);
}

TEST(HardWatch, ACardThatIsBehindTheWallAfterOneStepWentThroughItAndOneBesideItDidNot) {
    sim::WorldDefinition world;
    world.bodies = {body_at({0, 0, 0}, {0.025, 1, 1}, 0.1), body_at({-1, 0, 0}, {0.005, 0.1, 0.1}, 0.1)};
    world.bodies[0].fixed = true;
    std::vector<RigidState> states = states_of(world);
    for (const auto& [end, through] :
         {std::pair(Vector3d(1, 0, 0), 1), {Vector3d(1, 4, 0), 0}, {Vector3d(-0.03, 0, 0), 0}}) {
        states[1].position = end;
        EXPECT_EQ(seen(world, states, Right::stops, -0.03).through, through) << end.transpose();
    }
    EXPECT_TRUE(seen(world, states, Right::stops, -0.03).right);
    EXPECT_FALSE(seen(world, states_of(world), Right::stops, -0.03).right);
}

TEST(HardWatch, ABallThatGoesHalfRoundAnotherInAStepDidNotGoThroughItAndOneThatFliesStraightDid) {
    sim::WorldDefinition world;
    world.bodies = {ball_at({0, 0, 0}), ball_at({2, 0, 0})};
    for (const bool round : {true, false}) {
        const Vector3d start = round ? Vector3d(0, 2 * M_PI, 0) : Vector3d(-4, 0, 0);
        world.bodies[1].velocity = start;
        std::vector<RigidState> states = states_of(world);
        states[1].position = {-2, 0, 0};
        states[1].velocity = round ? Vector3d(-start) : start;
        EXPECT_EQ(seen(world, states, Right::gains_none).through, round ? 0 : 2);
    }
}

TEST(HardWatch, BodiesThatAreNotFiniteAreLostAndThoseTooFastAreThrown) {
    sim::WorldDefinition world;
    world.bodies = {cube_at({0, 0.5, 0}), cube_at({0, 1.5, 0})};
    world.planes.push_back({});
    std::vector<RigidState> states = states_of(world);
    EXPECT_TRUE(seen(world, states, Right::rests).right);
    states[1].velocity.y() = 10;  // 50 J/kg, where falls by 1 m (its extent) and 1.5 m free 24.5 J/kg
    const HardFigures fast = seen(world, states, Right::rests);
    EXPECT_EQ(fast.thrown, 1);
    EXPECT_NEAR(fast.energy_gained, 50 / (2.5 * 9.81), 1e-9);
    EXPECT_FALSE(fast.right);
    states[1].velocity.y() = std::nan("");
    const HardFigures lost = seen(world, states, Right::rests);
    EXPECT_EQ(lost.quarantined, 1);
    EXPECT_TRUE(std::isinf(lost.error));
}

TEST(HardScenes, EachHasAFileWhoseHeadSaysWhatIsRightAndEachFileIsOne) {
    std::vector<std::string> listed;
    for (const HardScene& scene : app::hard_scenes()) {
        listed.push_back(scene.name);
        std::ifstream file(app::find_bundled("hard/" + scene.name, "scenes"));
        std::string head, line;
        while (std::getline(file, line) && line.starts_with("#")) head += line;
        EXPECT_NE(head.find("# Right: "), std::string::npos) << scene.name;
    }
    const std::vector<std::string> files = app::bundled_names("scenes/hard");
    EXPECT_EQ(listed, app::kHardSceneNames);
    EXPECT_EQ(std::set<std::string>(listed.begin(), listed.end()),
              std::set<std::string>(files.begin(), files.end()));
}

TEST(HardScenes, PeersBeginWhereTheSceneDoes) {
    for (const HardScene& scene : app::hard_scenes()) {
        const app::Scene read = app::read_scene(app::find_bundled("hard/" + scene.name, "scenes"));
        const std::vector<RigidState> expected = states_of(read.world);
        for (const sim_bench::PeerLibrary& peer : sim_bench::rigid_peers())
            for (const bool hulls : {false, true}) {
                const auto world = peer.make(read.world, {1.0 / 60, false, hulls, peer.methods.front()});
                const std::vector<RigidState> states = world->states();
                ASSERT_EQ(states.size(), expected.size()) << scene.name;
                for (std::size_t i = 0; i < states.size(); ++i) {
                    // Single precision of a few metres and of 100 rad/s.
                    EXPECT_LT((states[i].position - expected[i].position).norm(), 1e-6)
                        << peer.name << scene.name;
                    EXPECT_LT((states[i].velocity - expected[i].velocity).norm(), 1e-5)
                        << peer.name << scene.name;
                    EXPECT_LT((states[i].angular_velocity - expected[i].angular_velocity).norm(), 1e-5)
                        << peer.name << scene.name;
                    EXPECT_LT(states[i].orientation.angularDistance(expected[i].orientation), 1e-3)
                        << peer.name << scene.name;
                }
            }
    }
}

app::HardRun run_of(const char* engine, double error, double ms, bool right) {
    app::HardRun run;
    run.scene = "a scene", run.engine = engine, run.version = "1", run.settings = "s", run.dt_s = 0.01;
    run.ms_per_s = ms;
    run.figures.error = error, run.figures.right = right;
    return run;
}

TEST(HardComparison, TheBestOfAPeerIsItsCheapestRunThatIsRightAndErrsNoMoreThanOurs) {
    app::HardComparison c;
    c.scene = {"a scene", Right::rests, 0.1};
    c.entrants = {{{run_of("ours", 0.01, 1, true)}},
                  {{run_of("theirs", 0.05, 2, true), run_of("theirs", 0.01, 4, true)}},
                  {{run_of("theirs", 0.001, 3, false), run_of("theirs", 0.001, 9, true)}}};
    ASSERT_TRUE(c.best_of("theirs"));
    EXPECT_EQ(c.best_of("theirs")->ms_per_s, 4);
    EXPECT_EQ(c.best_of("nobody"), nullptr);
    c.entrants[0].runs[0].figures.right = false;  // then what is right will do
    EXPECT_EQ(c.best_of("theirs")->ms_per_s, 2);
    EXPECT_EQ(c.best_of("ours"), nullptr);
    const Json json = Json::parse(app::figures_of(app::HardBench{{c}, {}}).json);
    for (const Json& result : json["results"])
        for (const char* key : {"name", "value", "unit", "peer", "peer_version", "ratio"})
            EXPECT_TRUE(result.contains(key)) << key;
    EXPECT_EQ(json["results"][1]["name"], "hard_a scene_vs_theirs");
    EXPECT_TRUE(json["results"][1]["ratio"].is_null()) << "ours is not right";
    EXPECT_EQ(json["runs"].size(), 5u);
}

TEST(HardComparison, WhereNothingIsRightThereIsAPageAndAPlotAllTheSame) {
    app::HardComparison c;
    c.scene = {"a scene", Right::rests, 0.1};
    c.entrants = {{{run_of("ours", std::numeric_limits<double>::infinity(), 1, false)}}};
    const TemporaryFolder scratch;
    const app::Figures figures = app::figures_of(app::HardBench{{c}, {}});
    app::Plotter plotter(scratch.path());
    EXPECT_NE(plotter.draw({figures.plots.at("hard.svg")}).front().find("a scene"), std::string::npos);
    const app::BenchPage& page = figures.pages.at("hard.html");
    const std::string drawn = page.plots.drawn(page.text, plotter);
    EXPECT_NE(drawn.find("<table"), std::string::npos);
    EXPECT_NE(drawn.find("<svg"), std::string::npos);
}

TEST(BenchHard, TwoShortScenesRunBesideThePeersThatAreThere) {
    app::HardBenchOptions options;
    options.scenes = {"ghost", "card_through_wall"};
    options.halvings = 1;
    const app::HardBench bench = app::bench_hard(options, [](const std::string&) {});
    ASSERT_EQ(bench.scenes.size(), 2u);
    std::set<std::string> engines;
    for (const app::HardComparison& scene : bench.scenes)
        for (const app::HardEntrant& entrant : scene.entrants)
            for (const app::HardRun& run : entrant.runs) {
                engines.insert(run.engine);
                EXPECT_GT(run.ms_per_s, 0);
                EXPECT_EQ(run.figures.quarantined, 0);
                // Peers find no way past the card; nobody may invent a contact.
                const bool expected = scene.scene.name == "ghost" || run.engine == "MusicWorld";
                EXPECT_TRUE(!expected || run.figures.right) << run.engine << ' ' << run.figures.error;
            }
    EXPECT_EQ(engines.size(), 1 + sim_bench::rigid_peers().size());
    const app::Figures figures = app::figures_of(bench);
    const std::string& csv = figures.tables.at("hard.csv");
    for (const std::string& engine : engines) EXPECT_NE(figures.text.find(engine), std::string::npos);
    EXPECT_EQ(static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')),
              1 + Json::parse(figures.json)["runs"].size());
}

}  // namespace
