#include "simulate/kept_accuracy.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "simulate/simulate.h"
#include "written_scene.h"

namespace app {
namespace {

using nlohmann::json;

const std::string kBall =
    "[settings]\nsleeping = false\naccuracy = 0.05\n[material.m]\nyoung_pa = 6e6\ndensity_kg_m3 = 300\n"
    "[[plane]]\n[[body]]\nname = \"ball\"\nradius = 0.5\nmaterial = \"m\"\nposition = [0, 0.52, 0]\n"
    "velocity = [0, -1, 0]\n";

SimulateOptions measured_steps(const WrittenScene& scene, std::uint64_t steps) {
    SimulateOptions options;
    options.scene = scene.file();
    options.steps = steps;
    return options;
}

TEST(KeptAccuracy, ItsStepsAreTheScenesTimeAndItsSummaryHoldsTheEstimate) {
    const WrittenScene scene(kBall);
    const json r = json::parse(format_simulate(simulate(measured_steps(scene, 18))));
    const json& accuracy = r["accuracy"];
    EXPECT_EQ(accuracy["asked"], 0.05);
    const int parts = accuracy["step_parts"];
    EXPECT_GT(parts, 1) << "its impact lasts three steps";
    EXPECT_EQ(r["steps"], 18 * parts);
    EXPECT_EQ(r["dt_s"], 1.0 / 60 / parts);
    EXPECT_NEAR(double(r["time_s"]), 0.3, 1e-9);
    ASSERT_EQ(accuracy["worst"].size(), 1u);
    const json& worst = accuracy["worst"][0];
    EXPECT_EQ(worst["body"], "ball");
    EXPECT_NEAR(double(worst["error"]),
                double(worst["step"]) + double(worst["truncation"]) + double(worst["mesh"]) +
                    double(worst["linearity"]) + double(worst["samples"]),
                1e-12);
    EXPECT_EQ(accuracy["estimated"], worst["error"]);
    EXPECT_EQ(accuracy["kept"], double(worst["error"]) <= 0.05);
}

TEST(KeptAccuracy, TheOptionStandsInForTheScenesAndAStepThatIsGivenStays) {
    const WrittenScene scene(kBall);
    SimulateOptions options = measured_steps(scene, 18);
    options.accuracy = 0.3;
    options.dt_s = 1.0 / 120;
    const SimulateResult r = simulate(options);
    ASSERT_TRUE(r.accuracy);
    EXPECT_EQ(r.accuracy->report.accuracy, 0.3);
    EXPECT_EQ(r.steps, 18u);
    EXPECT_EQ(r.dt_s, 1.0 / 120);
    options.accuracy.reset();
    EXPECT_TRUE(json::parse(format_simulate(simulate(options)))["accuracy"].is_object());
    const WrittenScene plain("[[body]]\nname = \"ball\"\nradius = 0.5\n");
    EXPECT_TRUE(json::parse(format_simulate(simulate(measured_steps(plain, 2))))["accuracy"].is_null());
}

TEST(KeptAccuracy, AFolderThatCannotBeIsRefusedBeforeAnyTrial) {
    const WrittenScene scene(kBall);
    SimulateOptions options = measured_steps(scene, 1'000'000'000);  // trials of which would take days
    options.out = scene.file();
    EXPECT_THROW((void)simulate(options), BadInput);
}

TEST(KeptAccuracy, WorkersComputeWhatWasChosenForOneProcess) {
    const WrittenScene scene(kBall);
    const SimulateResult alone = simulate(measured_steps(scene, 12));
    SimulateOptions options = measured_steps(scene, 12);
    options.workers.emplace();
    options.workers->count = 2;
    options.workers->simulated.emplace();
    options.workers->simulated->count = 2;
    options.workers->simulated->modelled = true;
    const SimulateResult shared = simulate(options);
    EXPECT_EQ(shared.state_hash, alone.state_hash);
    EXPECT_EQ(shared.accuracy->json(), alone.accuracy->json());
}

TEST(KeptAccuracy, WhatIsNotKeptIsSaidWithTheBodyAndTheParts) {
    KeptAccuracy kept;
    kept.names = {"a", "b"};
    kept.report.accuracy = 0.01;
    kept.report.bodies.resize(2);
    kept.report.bodies[1] = {0.001, 0.012, 0.002, 0, 0.004, 0.25};
    kept.report.step_parts = 4, kept.report.trials = 5;
    kept.report.parted_s = 0.5, kept.report.parted_body = 1;
    EXPECT_FALSE(kept.is_kept());
    EXPECT_EQ(
        kept.lines(),
        (std::vector<std::string>{
            "accuracy 0.01 is not kept by 1 of 2 bodies: estimated b 0.019 (step 0.004, truncation 0.012, "
            "mesh 0.001, linearity 0.002, samples 0; loaded at 0.25 s); a step in 4 parts, after 5 trials",
            "from 0.5 s on paths hang on the length of the step: b first"}));
    kept.report.accuracy = 0.02;
    EXPECT_TRUE(kept.is_kept());
    EXPECT_EQ(kept.lines().size(), 1u);
    EXPECT_EQ(kept.lines()[0].rfind("accuracy 0.02: estimated b 0.019", 0), 0u);
}

TEST(Simulate, AModalBodyThatSpinsTooFastForModesWithoutCentrifugalLoadIsNamed) {
    const auto spun = [](double spin) {
        const WrittenScene scene(
            "[settings]\ngravity = [0, 0, 0]\n[material.m]\nyoung_pa = 1e6\ndensity_kg_m3 = 1000\n[[body]]\n"
            "name = \"bar\"\nsize = [1, 0.1, 0.1]\nfidelity = \"modal\"\nmaterial = \"m\"\nspin = [0, " +
            std::to_string(spin) + ", 0]\n");
        return json::parse(format_simulate(simulate(measured_steps(scene, 3))));
    };
    // rho w^2 a^2 / (3 E) = 0.01: w = 10.95 rad/s.
    EXPECT_TRUE(spun(10)["spun"].empty());
    const json fast = spun(12);
    ASSERT_EQ(fast["spun"].size(), 1u);
    EXPECT_EQ(fast["spun"][0]["body"], "bar");
    ASSERT_EQ(fast["notes"].size(), 1u);
    EXPECT_NE(std::string(fast["notes"][0]).find("centrifugal"), std::string::npos);
}

TEST(KeptAccuracy, ItIsAShareFromATenThousandthToAHalf) {
    const WrittenScene wrong("[settings]\naccuracy = 2\n[[body]]\nname = \"a\"\nradius = 1\n");
    EXPECT_NE(wrong.refusal().find(":2:"), std::string::npos) << wrong.refusal();
    EXPECT_NE(wrong.refusal().find("accuracy = 2"), std::string::npos) << wrong.refusal();
}

}  // namespace
}  // namespace app
