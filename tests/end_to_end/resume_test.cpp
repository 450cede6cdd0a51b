// simulate --checkpoint and --resume: runs that are killed, whose disk fails, whose checkpoints are damaged.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <thread>

#include "program.h"

namespace end_to_end {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using nlohmann::json;
using Words = std::vector<std::string>;

Words operator+(Words a, const Words& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

/// What a run wrote, without what it measured.
std::map<std::string, std::string> products_of(const fs::path& out) {
    std::map<std::string, std::string> files = read_tree(out, {"times.csv"});
    std::erase_if(files, [](const auto& file) { return file.first.starts_with(".unfinished/"); });
    json summary = json::parse(files.at("summary.json"));
    for (const char* measured : {"elapsed_s", "cpu_s", "ns_per_body_step", "wall_s"}) summary.erase(measured);
    files["summary.json"] = summary.dump(1);
    return files;
}

fs::path checkpoint_of(const fs::path& out) {
    return out / ".unfinished/scratch/checkpoint";
}

/// Kills the run several times, soon after it has begun or gone on from a checkpoint, then lets it end.
/// Returns how often it was gone on with.
int run_among_kills(const Words& command, const fs::path& out, int kills, unsigned seed) {
    std::mt19937 random(seed);
    const Folder streams;
    int resumed = 0;
    for (int kill = 0; !fs::exists(out / "summary.json"); ++kill) {
        const bool goes_on = fs::exists(checkpoint_of(out));
        resumed += goes_on;
        Started started(goes_on ? Words{"simulate", "--resume", out.string()} : command, streams / "");
        if (kill < kills) {
            // Until there is something to go on from, or less.
            for (int i = 0; i < 12000 && !fs::exists(checkpoint_of(out)) && kill % 4 != 3; ++i)
                std::this_thread::sleep_for(5ms);
            if (kill > 0) std::this_thread::sleep_for(std::chrono::microseconds(random() % 150'000));
            ::kill(started.pid(), SIGKILL);
        }
        const Ended ended = started.wait();
        EXPECT_TRUE(ended.status == 0 || (ended.status == 128 + SIGKILL && kill < kills))
            << ended.status << ended.err;
        if (testing::Test::HasFailure()) break;
    }
    return resumed;
}

TEST(Resume, ARunThatIsKilledAtAnyMomentGoesOnToTheSameFilesAndPictures) {
    const Folder folder;
    const Words command = {"simulate", "joints", "--steps", "150", "--frames",
                           "--size",   "64x48",  "--fps",   "20"};
    ASSERT_EQ(run(command + Words{"--out", folder / "whole"}).status, 0);
    const auto whole = products_of(folder / "whole");
    EXPECT_GT(whole.size(), 40u);
    int resumed = 0;
    for (const unsigned seed : {1u, 2u, 3u}) {
        const fs::path out = folder / ("killed" + std::to_string(seed));
        resumed += run_among_kills(command + Words{"--out", out, "--checkpoint", seed == 1 ? "1" : "11"}, out,
                                   6, seed);
        ASSERT_FALSE(HasFailure());
        EXPECT_EQ(products_of(out), whole);
        EXPECT_FALSE(fs::exists(out / ".unfinished"));
    }
    EXPECT_GE(resumed, 3);
}

/// A folder with a run that was killed after it had saved a checkpoint, or more.
void kill_after_checkpoint(const Words& command, const fs::path& out) {
    const Folder streams;
    Started started(command + Words{"--out", out}, streams / "");
    for (int i = 0; i < 12000 && !fs::exists(checkpoint_of(out)); ++i) std::this_thread::sleep_for(5ms);
    ::kill(started.pid(), SIGKILL);
    (void)started.wait();
    ASSERT_TRUE(fs::exists(checkpoint_of(out)));
}

TEST(Resume, AnotherSceneOtherOptionsOrADamagedFileAreRefusedWithTheirPlace) {
    const Folder folder;
    const fs::path scene = folder / "scene.toml", out = folder / "out", file = checkpoint_of(out);
    const std::string text =
        "[settings]\nsleeping = false\n[[body]]\nname = \"b\"\nradius = 0.3\nposition = [0, 1, "
        "0]\n[[plane]]\n";
    write(scene, text);
    kill_after_checkpoint({"simulate", scene, "--steps", "1000000", "--checkpoint", "10", "--fps", "0.1"},
                          out);
    const std::string good = read(file);
    const auto refused = [&](const Words& more, const std::string& what) {
        const Ended ended = run(Words{"simulate", "--resume", out} + more);
        expect_refused(ended, what);
        EXPECT_NE(ended.err.find(file.string()), std::string::npos) << ended.err;
        EXPECT_TRUE(fs::exists(file));  // a refusal takes nothing away
    };
    refused({"--steps", "20"}, "--steps=20");
    refused({"human"}, "human");
    refused({"--dt", "1/50"}, "--dt=1/50");
    refused({"--workers", "2"}, "--workers=2");
    write(scene, text + "# changed\n");
    refused({}, "SHA-256");
    write(scene, text);
    for (const std::size_t at : {std::size_t(0), std::size_t(9), std::size_t(13), std::size_t(17),
                                 std::size_t(100), good.size() / 2, good.size() - 1}) {
        std::string bad = good;
        bad[at] = char(bad[at] ^ 0x81);
        write(file, bad);
        refused({}, ":byte ");
        write(file, good.substr(0, at));
        refused({}, ":byte ");
    }
    write(file, good + "more");
    refused({}, ":byte ");
    write(file, good);
    fs::resize_file(out / ".unfinished/energy.csv", 10);
    expect_refused(run({"simulate", "--resume", out}), "found 10 bytes");
    fs::remove_all(out);
    expect_refused(run({"simulate", "--resume", out}), "no such file");
    EXPECT_FALSE(fs::exists(out));
    expect_refused(run({"simulate", "human", "--checkpoint", "5"}), "--out");
    expect_refused(run({"simulate", "human", "--checkpoint", "5", "--out", out, "--workers", "2"}),
                   "--workers 0");
    expect_refused(run({"simulate"}), "SCENE");
}

long stride() {
    if (const char* chosen = std::getenv("MUSICWORLD_FAULTS")) return std::max(1L, std::atol(chosen));
    return std::getenv("MUSICWORLD_LONG") != nullptr ? 1 : 41;
}

TEST(Resume, WhateverCallFailsWhileACheckpointIsSavedTheRunEndsWholeOrGoesOnToTheSame) {
#ifdef MUSICWORLD_SANITIZED
    GTEST_SKIP() << "the sanitizer must be the first library";
#endif
    const Folder folder;
    const fs::path out = folder / "work/out";
    const Words command = {"simulate", "joints",   "--steps", "12",    "--checkpoint", "3", "--out",
                           out,        "--frames", "--size",  "64x48", "--fps",        "20"};
    fs::create_directory(folder / "work");
    ASSERT_EQ(run(command).status, 0);
    const auto whole = products_of(out);
    const auto strike = [&](const std::string& error, long at, bool stays) {
        fs::remove_all(out);
        return run(command, {"LD_PRELOAD=" MUSICWORLD_FAILING_CALLS,
                             "FAULTS_UNDER=" + fs::canonical(folder / "work").string(),
                             "FAULTS_LOG=" + (folder / "log").string(), "FAULTS_ERROR=" + error,
                             "FAULTS_AT=" + std::to_string(at), "FAULTS_STAY=" + std::to_string(stays)});
    };
    int resumed = 0, told = 0;
    for (const auto& [error, stays] : {std::pair("ENOSPC", true), {"ENOSPC", false}, {"EIO", false}}) {
        ASSERT_EQ(strike(error, 0, stays).status, 0);
        std::istringstream log(read(folder / "log"));
        long calls = 0;
        log >> calls;
        EXPECT_GT(calls, 30);
        for (long at = 1 + (calls - 1) % stride(); at <= calls; at += stride()) {
            SCOPED_TRACE(std::string(error) + (stays ? " from call " : " at call ") + std::to_string(at));
            const Ended ended = strike(error, at, stays);
            told += ended.status == 0 && ended.err.find("without a checkpoint") != std::string::npos;
            if (ended.status == 0) {
                ASSERT_EQ(products_of(out), whole);
            }
            if (fs::exists(checkpoint_of(out))) {  // of a run that has ended, where it could not be removed
                const Ended again = run({"simulate", "--resume", out});
                ASSERT_EQ(again.status, 0) << again.err;
                ++resumed;
            } else if (ended.status != 0) {
                continue;  // before there was a checkpoint
            }
            ASSERT_EQ(products_of(out), whole);
        }
    }
    EXPECT_GT(resumed, 0);
    std::printf("gone on with %d times, a checkpoint less %d times\n", resumed, told);
}

}  // namespace
}  // namespace end_to_end
