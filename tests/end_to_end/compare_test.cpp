// `musicworld compare` as a user runs it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

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
    const auto document = nlohmann::json::parse(read(folder / "a" / "compare.json"));
    std::map<std::string, int> rows;
    for (const auto& row : document["results"]) ++rows[row["predictor"]];
    for (const char* predictor :
         {"difference", "thesis", "cv", "singer:alpha=3,q=1e10", "naive", "cv*", "naive*"})
        EXPECT_EQ(rows[predictor], 2 * 2 * 2) << predictor;  // two traces of two sticks at two leads
    EXPECT_EQ(read_csv(folder / "a" / "compare.csv").size(), document["results"].size());
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
    const auto document = nlohmann::json::parse(read(folder / "out" / "compare.json"));
    for (const auto& row : document["results"]) {
        rows += row["predictor"] == "mine";
        if (row["trace"] != roll || row["lead_s"].get<double>() < 0.05 || row["stick"] != "right") continue;
        rms[row["predictor"]] = row["rms_mm"];
        tip[row["predictor"]] = row["tip_rms_mm"];
    }
    EXPECT_EQ(rows, 2);                             // two sticks of one trace at one lead
    EXPECT_NEAR(rms["mine"], rms["thesis"], 1e-6);  // t + lead is rounded where it is written
    EXPECT_NEAR(tip["mine"], tip["thesis"], 1e-6);
}

TEST(Compare, AnExperimentRepeatsItFromAnywhereAndRefusesOtherBytes) {
    const Folder folder;
    const std::string trace = (folder / "mine.csv").string();
    fs::copy_file(bundled("traces/roll.csv"), trace);
    const auto compare = [&](std::vector<std::string> arguments, const std::string& out) {
        arguments.insert(arguments.begin(), "compare");
        arguments.insert(arguments.end(), {"--out", (folder / out).string()});
        return run(arguments);
    };
    const std::string samples = (folder / "samples.csv").string();
    const Ended first =
        compare({"flourish", trace, "--predictors", "cv:decay=8,learned", "--no-cost", "--leads", "1/30",
                 "--tune", "feints", "roll", "--rate", "60", "--plane", "contact+0.02", "--samples", samples},
                "a");
    ASSERT_EQ(first.status, 0) << first.err;
    const std::string experiment = (folder / "a" / "experiment.toml").string();
    const Ended second = compare({"--experiment", experiment}, "b");
    ASSERT_EQ(second.status, 0) << second.err;
    EXPECT_EQ(second.out, first.out);
    EXPECT_EQ(read_tree(folder / "a", {}), read_tree(folder / "b", {}));

    // Of what it says of itself.
    const auto document = nlohmann::json::parse(read(folder / "a" / "compare.json"));
    std::set<std::string> inputs;
    for (const auto& input : document["inputs"]) inputs.insert(fs::path(input["file"]).filename());
    EXPECT_EQ(inputs,
              (std::set<std::string>{"general.model", "mine.csv", "flourish.csv", "feints.csv", "roll.csv"}));
    std::map<std::string, std::pair<double, int>> squares;
    for (const auto& row : read_csv(samples)) {
        auto& [sum, count] = squares[row.at("trace") + row.at("stick") + row.at("predictor")];
        sum += std::pow(std::stod(row.at("error_mm")), 2), ++count;
        EXPECT_NEAR(
            std::hypot(std::stod(row.at("ex_mm")), std::stod(row.at("ey_mm")), std::stod(row.at("ez_mm"))),
            std::stod(row.at("error_mm")), 2e-4)
            << "four digits";
    }
    for (const auto& row : document["results"]) {
        const auto& [sum, count] =
            squares.at(row["trace"].get<std::string>() + row["stick"].get<std::string>() +
                       row["predictor"].get<std::string>());
        EXPECT_EQ(count, row["predictions"]);
        EXPECT_NEAR(std::sqrt(sum / count), row["rms_mm"], 1e-4) << row;
    }
    int svg = 0, png = 0;
    for (const auto& figure : fs::directory_iterator(folder / "a" / "figures")) {
        svg += figure.path().extension() == ".svg";
        png += figure.path().extension() == ".png" && fs::file_size(figure) > 1000;
    }
    EXPECT_GT(svg, 4);
    EXPECT_EQ(svg, png);

    expect_refused(compare({"--experiment", experiment, "--no-tuning"}, "c"), "--no-tuning");
    expect_refused(compare({}, "c"), "TRACE");
    std::ofstream(trace, std::ios::app) << "\n";
    expect_refused(compare({"--experiment", experiment}, "c"), "mine.csv with other bytes");
    expect_refused(compare({"--experiment", trace}, "c"), "mine.csv:");
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
