#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "simulate/run_measures.h"
#include "simulate/simulate.h"
#include "temporary_folder.h"
#include "written_scene.h"

namespace app {
namespace {

using nlohmann::json;

std::string text_of(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
}

/// Rows of a CSV text by column.
std::vector<std::map<std::string, double>> table_of(const std::filesystem::path& file) {
    std::istringstream lines(text_of(file));
    const auto cells = [](const std::string& line) {
        std::vector<std::string> all;
        std::istringstream in(line);
        for (std::string cell; std::getline(in, cell, ',');) all.push_back(cell);
        return all;
    };
    std::string line;
    std::getline(lines, line);
    const std::vector<std::string> names = cells(line);
    std::vector<std::map<std::string, double>> rows;
    while (std::getline(lines, line)) {
        rows.emplace_back();
        const std::vector<std::string> values = cells(line);
        for (std::size_t k = 0; k < names.size(); ++k) rows.back()[names[k]] = std::stod(values.at(k));
    }
    return rows;
}

/// Two layers that fall on each other in a box; contacts cross any division of the bodies.
const std::string kPile =
    "[settings]\nsleeping = false\n[box]\nsize = [2.6, 2.6]\n[[body]]\nname = \"b\"\nradius = 0.5\n"
    "fidelity = \"linear\"\nposition = [0, 0.8, 0]\ngrid = { count = [2, 2, 2], step = [1.1, 1.1, 1.1], "
    "jitter = 0.05, seed = 3 }\n";

/// Simulated processors whose costs are counted, so that a run is a function of the scene.
WorkerOptions processors(int count) {
    WorkerOptions options;
    options.count = count;
    options.simulated.emplace();
    options.simulated->count = count;
    options.simulated->modelled = true;
    return options;
}

SimulateOptions options_for(const WrittenScene& scene, std::uint64_t steps) {
    SimulateOptions options;
    options.scene = scene.file();
    options.steps = steps;
    return options;
}

// Of exact states: what workers publish in between is rounded to 5e-4 of velocities.
TEST(SimulateWorkers, OutOfStepTheReportedMomentumIsKeptToRounding) {
    for (const std::string& scene :
         {kPile, std::string("[settings]\ngravity = [0, 0, 0]\n[defaults]\nradius = 0.5\nrestitution = 0.8\n"
                             "[[body]]\nname = \"a\"\nposition = [-0.8, 0.1, 0]\nvelocity = [2.1, 0, 0]\n"
                             "[[body]]\nname = \"b\"\nposition = [0.8, 0, 0]\nvelocity = [-0.7, 0, 0]\n")}) {
        const WrittenScene written(scene);
        SimulateOptions options = options_for(written, 75);
        options.workers = processors(2);
        const SimulateResult r = simulate(options);
        ASSERT_TRUE(r.drift);
        EXPECT_LT(r.drift->linear, 1e-9 * r.drift->scale) << scene;
    }
}

TEST(SimulateWorkers, TimingHasARowAWorkersStepAndEachStepsBodiesAreAllThere) {
    const WrittenScene scene(kPile);
    const TemporaryFolder folder;
    SimulateOptions options = options_for(scene, 40);
    options.out = folder.path() / "run";
    options.workers = processors(3);
    options.workers->balance = false;
    (void)simulate(options);
    std::map<double, double> bodies_at;
    std::map<double, int> rows_of;
    for (const auto& row : table_of(*options.out / "timing.csv")) {
        bodies_at[row.at("step")] += row.at("bodies");
        ++rows_of[row.at("worker")];
        EXPECT_GE(row.at("seconds"), 0);
        EXPECT_GE(row.at("waited_s"), 0);
    }
    // One more each: the last step once more, exact.
    EXPECT_EQ(rows_of, (std::map<double, int>{{0, 41}, {1, 41}, {2, 41}}));
    ASSERT_EQ(bodies_at.size(), 40u);
    for (const auto& [step, bodies] : bodies_at) EXPECT_EQ(bodies, step < 40 ? 8 : 16) << step;
    EXPECT_NE(text_of(*options.out / "workers.svg").find("worker 2"), std::string::npos);
    const json summary = json::parse(text_of(*options.out / "summary.json"));
    EXPECT_EQ(summary["workers"], 3);
    EXPECT_EQ(summary["bound"], 4);
    EXPECT_EQ(summary["bodies_lost"], 0);
    EXPECT_GT(summary["bytes_per_body_update"], 0);
    EXPECT_EQ(summary["clock"],
              "simulated processors, modelled costs, 1 times slower, 0.0002 s from worker to worker");
}

TEST(SimulateWorkers, AsynchronouslyNoWorkerLeadsByMoreThanTheBoundAndMomentumIsKept) {
    const WrittenScene scene(kPile);
    const TemporaryFolder folder;
    SimulateOptions options = options_for(scene, 120);
    options.out = folder.path() / "run";
    options.workers = processors(4);
    const SimulateResult r = simulate(options);
    EXPECT_EQ(r.worker_options->bound, 4);
    int most = 0;
    for (const auto& row : table_of(*options.out / "timing.csv")) {
        EXPECT_LE(row.at("lead"), 4);
        EXPECT_LE(row.at("ghost_age"), 4);
        most = std::max(most, int(row.at("lead")));
    }
    EXPECT_GT(r.cross_contacts, 0u);
    ASSERT_TRUE(r.drift);
    EXPECT_LT(r.drift->linear, 1e-3 * r.drift->scale);  // what is promised of asynchronous contacts
}

TEST(WorkerHistory, AMillionStepsOfTwoWorkersStayUnder4000PointsEachEquallyFarApart) {
    WorkerHistory history;
    for (std::uint64_t step = 1; step <= 1000000; ++step)
        for (int worker = 0; worker < 2; ++worker)
            history.add({.worker = worker, .step = step, .seconds = 1e-3, .bodies = int(step % 7)});
    ASSERT_EQ(history.workers().size(), 2u);
    const std::uint64_t every = history.workers().at(0)[1].step - history.workers().at(0)[0].step;
    for (const auto& [worker, points] : history.workers()) {
        EXPECT_LT(points.size(), 4000u);
        EXPECT_GT(points.size(), 1900u);
        for (std::size_t k = 1; k < points.size(); ++k)
            ASSERT_EQ(points[k].step - points[k - 1].step, every) << worker << ' ' << k;
    }
}

}  // namespace
}  // namespace app
