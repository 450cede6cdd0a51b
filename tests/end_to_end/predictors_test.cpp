// Predictors of one's own and `predict`, as a user runs them.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <sstream>

#include "program.h"

namespace end_to_end {
namespace fs = std::filesystem;
namespace {

using Rows = std::vector<std::map<std::string, std::string>>;

void expect_near(const Rows& own, const Rows& external, double tolerance) {
    ASSERT_EQ(own.size(), external.size());
    ASSERT_FALSE(own.empty());
    for (std::size_t i = 0; i < own.size(); ++i)
        for (const auto& [column, value] : own[i]) {
            if (column == "model") continue;
            const std::string& other = external[i].at(column);
            char* end = nullptr;
            const double number = std::strtod(value.c_str(), &end);
            if (*end == '\0')
                ASSERT_NEAR(number, std::stod(other), tolerance) << column << " of row " << i;
            else
                ASSERT_EQ(value, other) << column << " of row " << i;
        }
}

TEST(Predictors, TheExampleInPythonPredictsAndPlaysLikeDifference) {
    if (!has_python()) GTEST_SKIP() << "needs python3";
    const Folder folder;
    const std::string trace = (folder / "trace.csv").string();
    write(trace, cut_trace(read(bundled("traces/flourish.csv")), 2));
    for (const auto& [name, predictor] :
         {std::pair<std::string, std::string>{"own", "difference"}, {"external", python_example()}}) {
        const std::string rows = (folder / (name + ".csv")).string();
        const Ended predicted =
            run({"predict", trace, "--predictor", predictor, "--lead", "1/15", "--out", rows});
        ASSERT_EQ(predicted.status, 0) << predicted.err;
        const Ended played = run(
            {"play", trace, "--predictor", predictor, "--size", "64x48", "--out", (folder / name).string()});
        ASSERT_EQ(played.status, 0) << played.err;
    }
    // The bound asked for: 1e-9 mm.
    expect_near(read_csv(folder / "own.csv"), read_csv(folder / "external.csv"), 1e-12);
    // Contacts are found on those paths: rounding over the speeds and accelerations of a stroke.
    expect_near(read_csv(folder / "own/events.csv"), read_csv(folder / "external/events.csv"), 1e-8);
    int channels = 0;
    const std::vector<int> own = read_wav(folder / "own/audio.wav", channels);
    const std::vector<int> external = read_wav(folder / "external/audio.wav", channels);
    ASSERT_EQ(own.size(), external.size());
    EXPECT_NE(std::count(own.begin(), own.end(), 0), static_cast<std::ptrdiff_t>(own.size())) << "it sounds";
    EXPECT_TRUE(std::filesystem::exists(folder / "external/frames/000059.png"));
}

TEST(Predictors, WhatAPerformanceTaughtIsAModelToGoOnWith) {
    const Folder folder;
    const std::string trace = (folder / "trace.csv").string(),
                      base = bundled("models/general.model").string();
    write(trace, cut_trace(read(bundled("traces/flourish.csv")), 3));
    const auto weights = [](const std::string& model) { return model.substr(model.find("\n\n")); };
    for (const std::vector<std::string>& more :
         {std::vector<std::string>{}, {"--realtime", "--seconds", "3"}}) {
        const std::string model = (folder / ("mine" + std::to_string(more.size()))).string();
        const std::string out = (folder / "played").string();
        std::vector<std::string> words = {"play", trace, "--no-frames", "--out", out, "--save-model", model};
        words.insert(words.end(), more.begin(), more.end());
        const Ended played = run(words);
        ASSERT_EQ(played.status, 0) << played.err;
        EXPECT_TRUE(fs::exists(out + "/summary.json"));
        EXPECT_NE(weights(read(model)), weights(read(base)));
        EXPECT_NE(read(model).find("begun_with: "), std::string::npos);
        const Ended predicted =
            run({"predict", trace, "--predictor", "learned:model=" + model, "--lead", "1/30"});
        EXPECT_EQ(predicted.status, 0) << predicted.err;
        EXPECT_NE(predicted.out, run({"predict", trace, "--predictor", "learned", "--lead", "1/30"}).out);
        fs::remove_all(out);
    }
}

TEST(Predictors, AModelThatCannotBeSavedIsRefusedBeforeAnythingIsPlayed) {
    const Folder folder;
    const std::string trace = (folder / "two\nlines.csv").string(), out = (folder / "played").string();
    write(trace, cut_trace(read(bundled("traces/flourish.csv")), 1));
    expect_refused(run({"play", trace, "--no-frames", "--out", out, "--save-model", (folder / "m").string()}),
                   "provenance");
    expect_refused(run({"play", "flourish", "--no-frames", "--out", out, "--picture-predictor", "thesis",
                        "--save-model", (folder / "m").string()}),
                   "learns nothing");
    EXPECT_FALSE(fs::exists(out));
}

TEST(Predictors, PredictWritesTheSameRowsToAFileAndToStandardOutput) {
    const Folder folder;
    const std::string trace = bundled("traces/roll.csv").string(), file = (folder / "rows.csv").string();
    const std::vector<std::string> arguments = {"predict", trace, "--predictor", "auto", "--lead", "1/30",
                                                "--rate",  "60",  "--noise",     "0.25", "--seed", "3"};
    std::vector<std::string> to_file = arguments;
    to_file.insert(to_file.end(), {"--out", file});
    const Ended printed = run(arguments), written = run(to_file);
    EXPECT_EQ(printed.status, 0) << printed.err;
    EXPECT_EQ(written.status, 0) << written.err;
    EXPECT_TRUE(written.out.empty());
    EXPECT_EQ(printed.out, read(file));
    EXPECT_TRUE(printed.out.starts_with("t,stick,px,py,pz,qw,qx,qy,qz\n"));
    // 60 Hz for as long as the trace is, two sticks, no row for the first sample of each.
    const auto [first, last] = time_span(read(trace));
    const auto samples = static_cast<std::ptrdiff_t>(std::floor((last - first) * 60 + 1e-6)) + 1;
    EXPECT_NEAR(static_cast<double>(read_csv(file).size()), static_cast<double>(2 * (samples - 1)), 2);
}

TEST(Predictors, AFaultyChildEndsTheProgramWithOneLineAndStatus1) {
    const Folder folder;
    const std::string trace = bundled("traces/flourish.csv").string();
    const std::vector<std::pair<std::string, std::string>> children = {
        {"exec:no-such-program-anywhere", "first line: error: found the child ended with status 127"},
        {"exec:read h; echo position; read l", "answer 1: error: found the child ended with status 0"},
        {"exec:read h; echo position; while read l; do echo nan nan nan; done",
         "answer 1: error: found \"nan\""},
        {"exec:read h; echo position; while read l; do echo 1 2; done", "answer 1: error: found 2 numbers"},
        {"exec:read h; echo position; sleep 100", "answer 1: error: found no whole line within 2 s"},
    };
    for (const auto& [child, message] : children) {
        const Ended predicted = run({"predict", trace, "--predictor", child, "--lead", "0.05", "--out",
                                     (folder / "rows.csv").string()});
        const Ended played = run(
            {"play", trace, "--sound-predictor", child, "--no-frames", "--out", (folder / "out").string()});
        for (const Ended& ended : {predicted, played}) {
            EXPECT_EQ(ended.status, 1) << child << ": " << ended.err;
            EXPECT_EQ(std::count(ended.err.begin(), ended.err.end(), '\n'), 1) << ended.err;
            EXPECT_EQ(ended.err.find(child + ", stick "), 0U) << ended.err;
            EXPECT_NE(ended.err.find("expected"), std::string::npos) << ended.err;
        }
        EXPECT_NE(predicted.err.find(message), std::string::npos) << predicted.err;
        EXPECT_FALSE(std::filesystem::exists(folder / "rows.csv"));
        EXPECT_FALSE(std::filesystem::exists(folder / "out/summary.json"));
    }
}

/// Whether a process is there and not merely uncollected.
bool is_running(int pid) {
    const std::string state = read("/proc/" + std::to_string(pid) + "/stat");
    return !state.empty() && state.find(") Z") == std::string::npos;
}

int count_children(int pid) {
    std::istringstream list(
        read("/proc/" + std::to_string(pid) + "/task/" + std::to_string(pid) + "/children"));
    int children = 0;
    for (int child = 0; list >> child;) ++children;
    return children;
}

/// Polls for a minute, far beyond what a loaded machine takes.
template <class Condition>
bool comes_true(const Condition& condition) {
    constexpr int kTries = 6000;
    for (int i = 0; i < kTries && !condition(); ++i) usleep(10000);
    return condition();
}

TEST(Predictors, ChildrenEndWithTheProgramHoweverItEnds) {
    for (const int signal : {SIGTERM, SIGINT, SIGKILL}) {
        const Folder folder;
        // The shell and a process that it has started; neither reads its input's end. Its first line comes once the
        // program has arranged for their end.
        const std::string child = "exec:read line; sleep 1000 & echo $! $$ > '" + (folder / "new").string() +
                                  "'; mv '" + (folder / "new").string() + "' '" + (folder / "pids").string() +
                                  "'; sleep 1000";
        Started program(
            {"predict", bundled("traces/roll.csv").string(), "--predictor", child, "--lead", "1/30"},
            folder / "");
        ASSERT_TRUE(comes_true([&] { return fs::exists(folder / "pids"); }));
        int background = 0, shell = 0;
        std::istringstream(read(folder / "pids")) >> background >> shell;
        ASSERT_TRUE(is_running(background) && is_running(shell));
        EXPECT_EQ(count_children(program.pid()), 1);  // nobody watches it
        kill(program.pid(), signal);
        EXPECT_EQ(program.wait().status, 128 + signal);
        EXPECT_TRUE(comes_true([&] { return !is_running(background) && !is_running(shell); }))
            << "after signal " << signal;
    }
}

TEST(Predictors, BadArgumentsOfPredictAreRefusedInOneLine) {
    const Folder folder;
    const std::string trace = bundled("traces/roll.csv").string();
    const std::vector<std::vector<std::string>> cases = {
        {"predict", trace, "--predictor", "hold"},
        {"predict", trace, "--lead", "0.1"},
        {"predict", trace, "--predictor", "oracle", "--lead", "0.1"},
        {"predict", trace, "--predictor", "exec:", "--lead", "0.1"},
        {"predict", trace, "--predictor", "hold", "--lead", "-0.1"},
        {"predict", trace, "--predictor", "hold", "--lead", "nan"},
        {"predict", trace, "--predictor", "hold", "--lead", "0.1", "--rate", "-5"},
        {"predict", trace, "--predictor", "hold", "--lead", "0.1", "--noise", "loud"},
        {"predict", trace, "--predictor", "hold", "--lead", "0.1", "--out",
         (folder / "no/where.csv").string()},
        {"predict", (folder / "none.csv").string(), "--predictor", "hold", "--lead", "0.1"},
    };
    for (const std::vector<std::string>& arguments : cases) expect_refused(run(arguments));
}

}  // namespace
}  // namespace end_to_end
