// Each call by which a command writes fails once, one run after the other (tests/faults/failing_calls.cpp): every
// product is whole or absent, and the exit status says whether all of them are there. MUSICWORLD_FAULTS=N strikes
// every N-th call; by default 41, or every one with MUSICWORLD_LONG.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>

#include "program.h"

namespace end_to_end {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;
using Files = std::map<std::string, std::string>;

long stride() {
    if (const char* chosen = std::getenv("MUSICWORLD_FAULTS")) return std::max(1L, std::atol(chosen));
    return std::getenv("MUSICWORLD_LONG") != nullptr ? 1 : 41;
}

/// A product that holds times: only its shape is the same on every run.
std::string shape_of(const std::string& name, const std::string& text) {
    if (name.ends_with(".json")) {
        const auto document = nlohmann::json::parse(text, nullptr, false);
        std::string keys = document.is_discarded() ? "broken" : "";
        for (const auto& [key, value] : document.items()) keys += key + " ";
        return keys;
    }
    if (name == "times.csv" ||
        name == "timing.csv") {  // how often workers do a step anew is a matter of time, too
        std::istringstream lines(text);
        std::string head, line;
        std::getline(lines, head);
        bool whole = text.ends_with('\n');
        while (std::getline(lines, line))
            whole &= std::ranges::count(line, ',') == std::ranges::count(head, ',');
        return head + (whole ? " whole" : " broken");
    }
    if (name.ends_with(".html"))
        return text.find("could not be drawn") != std::string::npos ? "without plots"
               : text.ends_with("</html>\n")                        ? "whole"
                                                                    : "broken";
    if (name.ends_with(".svg")) return text.find("</svg>") != std::string::npos ? "whole" : "broken";
    return text;
}

/// The files below a folder, but for what a run stages.
Files products_of(const fs::path& work) {
    Files products;
    for (const auto& [name, text] : read_tree(work, {}))
        if (name.find(".unfinished/") == std::string::npos && name.find(".partial") == std::string::npos)
            products[name] = shape_of(fs::path(name).filename(), text);
    return products;
}

struct Count {
    int runs = 0, whole = 0, failed = 0;
};

/// A command that writes into a folder, which its words name as WORK.
class FaultyRuns {
public:
    explicit FaultyRuns(Words command) : command_(std::move(command)) {
        for (std::string& word : command_)
            if (word.starts_with("WORK")) word = work().string() + word.substr(4);
        fs::create_directory(work());
        const Ended ended = run(command_);
        EXPECT_EQ(ended.status, 0) << ended.err;
        whole_ = products_of(work());
        EXPECT_FALSE(whole_.empty());
    }

    void strike_each(const std::string& error, bool stays = false) {
        const long calls = run_with(error, 0, stays).calls;
        EXPECT_GT(calls, 0);
        for (long at = 1 + (calls - 1) % stride(); at <= calls; at += stride()) {
            const Struck struck = run_with(error, at, stays);
            SCOPED_TRACE(error + (stays ? " from call " : " at call ") + std::to_string(at) + " of " +
                         std::to_string(calls) + ": " + struck.call);
            check(error, struck, stays);
            if (testing::Test::HasFailure()) return;
        }
    }
    [[nodiscard]] const Count& count() const { return count_; }

private:
    struct Struck {
        Ended ended;
        long calls = 0;
        std::string call;  // and its path; empty: none was struck
    };
    [[nodiscard]] fs::path work() const { return folder_ / "work"; }

    Struck run_with(const std::string& error, long at, bool stays) {
        fs::remove_all(work());
        fs::create_directory(work());
        Struck struck;
        struck.ended =
            run(command_,
                {"LD_PRELOAD=" MUSICWORLD_FAILING_CALLS, "FAULTS_UNDER=" + fs::canonical(work()).string(),
                 "FAULTS_LOG=" + (folder_ / "log").string(), "FAULTS_ERROR=" + error,
                 "FAULTS_AT=" + std::to_string(at), "FAULTS_STAY=" + std::to_string(stays)});
        std::istringstream log(read(folder_ / "log"));
        log >> struck.calls >> std::ws;
        std::getline(log, struck.call);
        return struck;
    }

    void check(const std::string& error, const Struck& struck, bool stays) {
        Files products = products_of(work());
        std::erase_if(products, [this](const auto& one) {  // a video's frames, which may stay
            return one.first.starts_with("out/frames/") && !whole_.contains(one.first);
        });
        const Ended& ended = struck.ended;
        ++count_.runs;
        ++(ended.status == 0 ? count_.whole : count_.failed);
        EXPECT_TRUE(ended.status == 0 || ended.status == 1 || ended.status == 2) << ended.status << ended.err;
        for (const auto& [name, text] : products) {
            const bool adorns = name.ends_with(".html");
            ASSERT_TRUE(whole_.contains(name)) << name;
            EXPECT_TRUE(text == whole_.at(name) || (adorns && text == "without plots"))
                << name << " is not whole";
        }
        const bool all = products == whole_;
        EXPECT_TRUE(all || ended.status != 0) << "something is missing";
        // A folder whose names could not be saved to the disk holds everything, but perhaps not after a loss of power.
        const bool saved = struck.call.find("sync ") == std::string::npos &&
                           !struck.call.ends_with("open " + work().string()) &&
                           !struck.call.ends_with("open " + (work() / "out").string());
        EXPECT_TRUE(!all || ended.status == 0 || !saved) << "nothing is missing: " << ended.err;
        EXPECT_LE(std::count(ended.err.begin(), ended.err.end(), '\n'), 1) << ended.err;
        EXPECT_TRUE(ended.status == 0 || (error != "EINTR" && error != "SHORT")) << ended.err;
        // What adorns a run takes nothing else with it.
        const bool of_plot = struck.call.find("/scratch/plots") != std::string::npos ||
                             struck.call.find("report.html") != std::string::npos ||
                             struck.call.find("workers.svg") != std::string::npos ||
                             struck.call.find(".mp4") != std::string::npos;
        if (of_plot && !stays && products.size() + 1 < whole_.size())
            ADD_FAILURE() << "results were lost: " << ended.err;
    }

    const Folder folder_;
    Words command_;
    Files whole_;
    Count count_;
};

void strike_all(const Words& command) {
#ifdef MUSICWORLD_SANITIZED
    GTEST_SKIP() << "the sanitizer must be the first library";
#endif
    FaultyRuns runs(command);
    for (const char* error : {"EIO", "ENOSPC", "EMFILE", "EINTR", "SHORT"}) runs.strike_each(error);
    runs.strike_each("ENOSPC", true);
    const Count& count = runs.count();
    std::printf("%s: %d runs with a failing call, %d whole, %d failed and said so\n", command[0].c_str(),
                count.runs, count.whole, count.failed);
}

std::string short_trace(const Folder& folder) {
    const std::string text = read(bundled("traces/roll.csv"));
    write(folder / "t.csv", cut_trace(text, time_span(text).first + 0.8));
    return (folder / "t.csv").string();
}

TEST(Faults, PlayLosesNothing) {
    const Folder folder;
    strike_all({"play", short_trace(folder), "--size", "16x16", "--fps", "5", "--out", "WORK/out"});
}

TEST(Faults, SimulateWithWorkersLosesNothing) {
    strike_all({"simulate", "joints", "--steps", "6", "--workers", "2", "--size", "16x16", "--fps", "60",
                "--frames", "--out", "WORK/out"});
}

TEST(Faults, RecordLosesNothing) {
    const Folder folder;
    strike_all(
        {"record", "--source", "trace:" + short_trace(folder), "--speed", "1000", "--out", "WORK/take.csv"});
}

TEST(Faults, CompareLosesNothing) {
    const Folder folder;
    strike_all({"compare", short_trace(folder), "--predictors", "hold", "--leads", "1/30", "--no-tuning",
                "--no-cost", "--out", "WORK/out"});
}

TEST(Faults, AVideoLosesNothing) {
    strike_all({"simulate", "joints", "--steps", "6", "--size", "16x16", "--fps", "60", "--video",
                "WORK/v.mp4", "--out", "WORK/out"});
}

TEST(Faults, CommandsThatWriteAFileLoseNothing) {
    const Folder folder;
    const std::string trace = short_trace(folder);
    for (const Words& command :
         {Words{"trace", "synth", "feints", "--out", "WORK/a.csv"},
          {"trace", "convert", trace, "--out", "WORK/a.csv"},
          {"predict", trace, "--predictor", "hold", "--lead", "0.1", "--out", "WORK/a.csv"},
          {"kit", "new", "mine", "--out", "WORK/kit.toml"},
          {"kit", "draw", "drums", "--size", "16x16", "--out", "WORK/kit.png"},
          {"modes", "--size", "1,2,3", "--young", "1e6", "--poisson", "0.3", "--density", "1000", "--out",
           "WORK/out"}})
        strike_all(command);
}

}  // namespace
}  // namespace end_to_end
