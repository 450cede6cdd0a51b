// `musicworld compare` as a user runs it.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "program.h"

namespace end_to_end {
namespace {

namespace fs = std::filesystem;

void expect_refused(const Ended& ended, const std::string& found) {
    EXPECT_EQ(ended.status, 2) << ended.err;
    EXPECT_EQ(std::count(ended.err.begin(), ended.err.end(), '\n'), 1) << ended.err;
    EXPECT_NE(ended.err.find(found), std::string::npos) << ended.err;
    EXPECT_NE(ended.err.find("expected"), std::string::npos) << ended.err;
    EXPECT_EQ(ended.out, "");
}

TEST(Compare, TwoBundledTracesGiveTheSameFilesTwiceAndSayWhichPredictorWins) {
    const Folder folder;
    const auto compare = [&](const std::string& out) {
        return run({"compare", bundled("traces/flourish.csv").string(), bundled("traces/roll.csv").string(),
                    "--predictors", "difference,thesis,cv,singer:alpha=3,q=1e10", "--rate", "60", "--noise",
                    "0.25", "--leads", "1/30,1/15", "--no-cost", "--out", (folder / out).string()});
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
    refused({trace, "--rate", "0"}, "--rate");
    refused({trace, "--noise", "-1"}, "--noise");
    refused({trace, "--predictions", "mine"}, "mine");
    refused({trace, "--predictions", "mine=" + trace}, "roll.csv");
    expect_refused(run({"compare", trace}), "--out");
}

}  // namespace
}  // namespace end_to_end
