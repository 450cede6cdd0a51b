#include <falling_bodies.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "bench/bench_report.h"
#include "bench/bench_sim.h"
#include "bench/bench_tradeoff.h"
#include "bench/rest_overlap.h"

namespace {

using Json = nlohmann::json;

const auto kSilent = [](const std::string&) {};

TEST(Bench, JsonHasTheContractsKeysAndNullWhereThereIsNoPeer) {
    app::BenchReport report;
    report.machine = {"A processor", "gcc 12", 2, true};
    report.results = {
        {"ours_alone", 1.5, "ms a step"},
        {"bodies25_modal12_vs_bullet_rigid", 2, "ms a step", "btRigidBody", "Bullet 3.24", 4.0, 0.5}};
    const Json json = Json::parse(app::figures_of(report).json);
    EXPECT_EQ(json["machine"]["cores"], 2);
    ASSERT_EQ(json["results"].size(), 2u);
    for (const char* key : {"name", "value", "unit", "peer", "peer_version", "ratio"})
        for (const Json& result : json["results"]) EXPECT_TRUE(result.contains(key)) << key;
    EXPECT_TRUE(json["results"][0]["ratio"].is_null());
    EXPECT_EQ(json["results"][1]["ratio"], 0.5);
    const std::string text = app::figures_of(report).text;
    for (const char* cell : {"btRigidBody", "Bullet 3.24", "  0.500\n"})
        EXPECT_NE(text.find(cell), std::string::npos) << cell;
}

TEST(Bench, LeastWorkGrowsByWhatEachPartNeeds) {
    // By hand: 10 samples x (6 x 2 + 18) + 1 substep x (6 x 2 + 100) + 3 points x (3 x 2 x 4 x 8 + 60).
    EXPECT_EQ(app::least_work(2, 10, 1, 3).flops, 300 + 112 + 3 * 252);
    EXPECT_GT(app::least_work(3, 10, 1, 3).flops, app::least_work(2, 10, 1, 3).flops);
    EXPECT_EQ(app::least_work(0, 10, 1, 0).bytes, 8 * 43);  // ten points and 13 numbers of state, in and out
}

TEST(Bench, FourBallsRunBesideBulletAndEveryFigureIsThere) {
    app::SimBenchOptions options;
    options.bodies = {4, 9};
    options.rounds = 1;
    options.steps = 30;
    const app::BenchReport report = app::bench_sim(options, kSilent);
    std::set<std::string> names;
    for (const app::BenchResult& result : report.results) {
        EXPECT_GT(result.value, 0) << result.name;
        names.insert(result.name);
        if (result.ratio) {
            EXPECT_NEAR(*result.ratio, result.value / *result.peer_value, 1e-9);
        }
    }
    for (const char* name :
         {"bodies4_modal12_vs_bullet_rigid", "bodies4_modal12_vs_bullet_reduced", "bodies9_modal12_per_body",
          "bodies9_modal12_share_of_bound", "per_body_at_9_over_4", "bodies4_modal12_overlap_at_rest"})
        EXPECT_TRUE(names.count(name)) << name;
}

TEST(RestOverlap, IsTheMeanDepthOfThePairsThatOverlapAlsoWhereModesMoveTheSurface) {
    sim::WorldDefinition definition;
    definition.planes.push_back({});
    for (const sim::Fidelity fidelity : {sim::Fidelity::rigid, sim::Fidelity::linear}) {
        definition.bodies.clear();
        for (const double x : {0.0, 0.98, 3.0}) {
            sim::WorldBody ball;
            ball.shape.base.semi_axes.setConstant(0.5);
            ball.material = {1e6, 0.3, 1000};
            ball.fidelity.fidelity = fidelity;
            ball.world_from_body.translation() = Eigen::Vector3d(x, x > 2 ? 0.49 : 0.6, 0);
            definition.bodies.push_back(ball);
        }
        sim::World world(definition);
        // 20 mm of two balls and 10 mm in the floor, of a metre.
        EXPECT_NEAR(app::mean_overlap(definition, world), 0.015, 1e-12);
        std::vector<sim_bench::RigidState> states;
        for (const sim::WorldBody& body : definition.bodies)
            states.push_back({body.world_from_body.translation(), Eigen::Quaterniond::Identity(),
                              Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()});
        EXPECT_NEAR(app::mean_overlap(definition, states), 0.015, 1e-12);
        if (fidelity == sim::Fidelity::rigid) continue;
        // A ball that is stretched along x reaches further into its neighbour, by what its mode moves the pole.
        sim::WorldBodyState state = world.state(0);
        const Eigen::Matrix3Xd pole = sim::mode_shapes_at(world.basis(0), {0.5, 0, 0});
        Eigen::Index mode = 0;
        pole.row(0).cwiseAbs().maxCoeff(&mode);
        state.q[mode] = 0.004 / pole(0, mode);
        world.set_state(0, state);
        EXPECT_NEAR(app::mean_overlap(definition, world), (0.024 + 0.01) / 2, 1e-12);
    }
}

TEST(RestOverlap, APeerAtEqualOverlapOverlapsNoMoreAndOneThatMustNotOverlapIsNotFound) {
    const sim::WorldDefinition world = sim_bench::falling_balls(4, 0);
    for (const sim_bench::PeerLibrary& library : sim_bench::rigid_peers()) {
        const auto equal = app::cheapest_equal(library, world, 120, 0.01);
        ASSERT_TRUE(equal) << library.name;
        EXPECT_LE(equal->overlap, 0.01) << library.name;
        EXPECT_FALSE(app::cheapest_equal(library, world, 120, -1)) << library.name;
    }
}

app::TradeoffPoint point(double ms_per_s, double error) {
    return {{}, ms_per_s, error, false};
}

TEST(Bench, TheParetoFrontIsWhatNothingElseBeatsInBoth) {
    std::vector<app::TradeoffPoint> points = {point(1, 5), point(2, 3), point(2, 4),
                                              point(3, 3), point(4, 1), point(5, 2)};
    app::mark_pareto(points);
    std::vector<bool> marked;
    for (const app::TradeoffPoint& p : points) marked.push_back(p.pareto);
    EXPECT_EQ(marked, (std::vector<bool>{true, true, false, false, true, false}));
}

TEST(Bench, AllModesStepsElementsAndTrianglesAreTriedOnce) {
    std::set<std::string> names;
    for (const app::TradeoffSetting& setting : app::all_tradeoff_settings())
        names.insert(app::name_of(setting));
    EXPECT_EQ(names.size(), (2 + 6 * 3) * 7 * 3u);
    EXPECT_EQ(names.size(), app::all_tradeoff_settings().size());
    EXPECT_TRUE(names.count("rigid_step1/30_elements1_triangles48"));
    EXPECT_TRUE(names.count("modal75_step1/1920_elements3_triangles2000"));
}

TEST(Bench, TheConvergedRunHasNoErrorAgainstItselfAndARigidBodyHasSome) {
    const app::TradeoffSetting good{sim::Fidelity::modal, 11, 240, 1, 360},
        rigid{sim::Fidelity::rigid, 0, 240, 1, 360};
    const app::Tradeoff made = app::measure_tradeoff({rigid, good}, good, good, kSilent);
    EXPECT_EQ(made.converged_error, 0);  // the same run twice has the same bits
    EXPECT_EQ(made.points[1].error, 0);
    EXPECT_GT(made.points[0].error, 0.005);
    EXPECT_LT(made.points[0].error, 0.5);
    ASSERT_GE(made.automatic.size(), 2u);
    EXPECT_LT(made.automatic.back().asked, made.automatic.front().asked);
    EXPECT_LT(made.automatic.back().point.error, made.automatic.front().point.error);
    const app::Figures figures = app::figures_of(made);
    const Json json = Json::parse(figures.json);
    EXPECT_EQ(json["results"].size(), 2u);
    EXPECT_EQ(json["results"][0]["modes"], 0);
    EXPECT_EQ(json["automatic"].size(), made.automatic.size());
    EXPECT_GT(json["automatic"][0]["estimated"], 0);
    const std::string& csv = figures.tables.at("tradeoff.csv");
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 3);
}

}  // namespace
