// `musicworld compare` as a user runs it.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "program.h"

namespace end_to_end {
namespace {

namespace fs = std::filesystem;

TEST(Compare, TwoBundledTracesGiveTheSameFilesTwiceAndSayWhichPredictorWins) {
    const Folder folder;
    const auto compare = [&](const std::string& out) {
        return run({"compare", "flourish", bundled("traces/roll.csv").string(), "--predictors",
                    "difference,thesis,cv,singer:alpha=3,q=1e10", "--rate", "60", "--noise", "0.25",
                    "--leads", "1/30,1/15", "--no-cost", "--out", (folder / out).string()});
    };
    const Ended first = compare("a"), second = compare("b");
    ASSERT_EQ(first.status, 0) << first.err;
    EXPECT_EQ(first.err, "");
    EXPECT_NE(first.out.find("33.3 ms ahead"), std::string::npos);
    EXPECT_NE(first.out.find("errs least"), std::string::npos);
    EXPECT_EQ(first.out, second.out);
    EXPECT_EQ(read_tree(folder / "a", {}), read_tree(folder / "b", {}));
    const auto json = nlohmann::json::parse(read(folder / "a" / "compare.json"));
    std::map<std::string, int> rows;
    for (const auto& row : json["results"]) ++rows[row["predictor"]];
    for (const char* predictor :
         {"difference", "thesis", "cv", "singer:alpha=3,q=1e10", "naive", "cv*", "naive*"})
        EXPECT_EQ(rows[predictor], 2 * 2 * 2) << predictor;  // two traces of two sticks at two leads
    EXPECT_EQ(read_csv(folder / "a" / "compare.csv").size(), json["results"].size());
}

TEST(Compare, WhatPredictWroteScoresAsThePredictorItself) {
    const Folder folder;
    const std::vector<std::string> sensor = {"--rate", "60", "--noise", "0.25", "--seed", "5"};
    const auto with_sensor = [&](std::vector<std::string> arguments) {
        arguments.insert(arguments.end(), sensor.begin(), sensor.end());
        return run(arguments);
    };
    const std::string flourish = bundled("traces/flourish.csv").string(),
                      roll = bundled("traces/roll.csv").string(), mine = (folder / "mine.csv").string();
    const Ended predicted =
        with_sensor({"predict", roll, "--predictor", "thesis", "--lead", "1/15", "--out", mine});
    ASSERT_EQ(predicted.status, 0) << predicted.err;
    const auto compare = [&](const std::string& predictions) {
        return with_sensor({"compare", flourish, roll, "--predictors", "thesis", "--leads", "1/30,1/15",
                            "--no-tuning", "--no-cost", "--predictions", predictions, "--out",
                            (folder / "out").string()});
    };
    // Both traces are sampled at the same times, so which one was predicted must be said.
    expect_refused(compare("mine=" + mine), "flourish.csv and ");
    const Ended compared = compare("mine=" + mine + "@" + roll);
    ASSERT_EQ(compared.status, 0) << compared.err;
    std::map<std::string, double> rms, tip;
    int rows = 0;
    const auto json = nlohmann::json::parse(read(folder / "out" / "compare.json"));
    for (const auto& row : json["results"]) {
        rows += row["predictor"] == "mine";
        if (row["trace"] != roll || row["lead_s"].get<double>() < 0.05 || row["stick"] != "right") continue;
        rms[row["predictor"]] = row["rms_mm"];
        tip[row["predictor"]] = row["tip_rms_mm"];
    }
    EXPECT_EQ(rows, 2);                             // two sticks of one trace at one lead
    EXPECT_NEAR(rms["mine"], rms["thesis"], 1e-6);  // t + lead is rounded where it is written
    EXPECT_NEAR(tip["mine"], tip["thesis"], 1e-6);
}

TEST(Compare, BadUsageIsOneLineAndLeavesNothing) {
    const Folder folder;
    const std::string trace = bundled("traces/roll.csv").string();
    const auto refused = [&](std::vector<std::string> arguments, const std::string& found) {
        arguments.insert(arguments.begin(), "compare");
        arguments.insert(arguments.end(), {"--out", (folder / "out").string()});
        expect_refused(run(arguments), found);
        EXPECT_FALSE(fs::exists(folder / "out")) << found;
    };
    refused({trace, "--predictors", "clairvoyant"}, "clairvoyant");
    refused({trace, "--predictors", "cv:q=fast"}, "fast");
    refused({(folder / "none.csv").string()}, "none.csv");
    refused({trace, "--tune", (folder / "none.csv").string()}, "none.csv");
    refused({trace, "--leads", "soon"}, "soon");
    refused({trace, "--leads", "-0.1"}, "-0.1");
    refused({trace, "--leads", "1/30,1/30"}, "twice");
    refused({trace, "--plane", "contact*2"}, "contact*2");
    refused({trace, "--plane", "1", "--kit", "drums"}, "--kit");
    refused({trace, "--rate", "-60"}, "--rate");
    refused({trace, "--noise", "-1"}, "--noise");
    refused({trace, "--predictions", "mine"}, "mine");
    refused({trace, "--predictions", "mine=" + trace}, "roll.csv");
    expect_refused(run({"compare", trace}), "--out");
}

}  // namespace
}  // namespace end_to_end
