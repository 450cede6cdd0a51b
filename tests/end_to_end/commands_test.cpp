// What holds for every command: how it is named, completed, interrupted, and what stands in its way.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "program.h"

namespace end_to_end {
namespace {

namespace fs = std::filesystem;

bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

TEST(Commands, AMisspeltNameIsRefusedWithTheNearest) {
    const auto refused = [](const std::vector<std::string>& words, const std::string& nearest) {
        expect_refused(run(words), nearest);
    };
    refused({"plai"}, "the nearest is play");
    refused({"simulat", "--steps"}, "the nearest is simulate");
    refused({"kit", "shw"}, "the nearest is show");
    refused({"play", "--soundlead", "1"}, "the nearest is --sound-lead");
    refused({"trace", "info"}, "found no TRACE");
    refused({"compare", "roll", "--kit", "drums", "--plane", "1", "--out", "o"}, "found --kit with --plane");
    refused({"play", "--seconds", "5"}, "found --seconds without --realtime");
    refused({"kit", "list", "all"}, "found argument all");
    const Ended far = run({"xylophone"});
    expect_refused(far, "found `musicworld xylophone`");
    EXPECT_FALSE(contains(far.err, "nearest"));
}

TEST(Commands, UnitsThatCannotBeAreTold) {
    const Folder folder;
    std::string trace = "t,stick,px,py,pz\n";  // mm without saying so
    for (int i = 0; i < 200; ++i)
        trace += std::to_string(0.01 * i) + ",right,0," + std::to_string(700 + 200 * std::sin(0.2 * i)) +
                 ",-400\n";
    write(folder / "mm.csv", trace);
    const Ended played =
        run({"play", folder / "mm.csv", "--no-frames", "--no-audio", "--out", folder / "out"});
    EXPECT_EQ(played.status, 0) << played.err;
    const std::string told = run({"trace", "check", folder / "mm.csv"}).err;
    EXPECT_NE(told.find("warning: "), std::string::npos);
    EXPECT_NE(told.find("are the units"), std::string::npos);
    EXPECT_EQ(played.err.substr(0, played.err.find('\n') + 1), told) << "the same line";
    EXPECT_EQ(run({"kit", "fit", folder / "mm.csv"}).err, told);
    EXPECT_EQ(
        run({"play", "flourish", "--no-frames", "--no-audio", "--out", folder / "out"}).err.find("warning"),
        std::string::npos);
    // What is refused is said in one line, as ever.
    expect_refused(run({"play", folder / "mm.csv", "--kit", "nowhere", "--out", folder / "none"}), "nowhere");
    expect_refused(run({"play", folder / "mm.csv", "--no-frames", "--solo", "7", "--out", folder / "none"}),
                   "--solo 7");
    expect_refused(run({"train", folder / "mm.csv", folder / "mm.csv", "--out", folder / "none.model"}),
                   "mm.csv again");

    std::string box = "usemtl body\n";  // of 200 mm
    for (int i = 0; i < 8; ++i)
        box += std::string("v ") + (i & 1 ? "100 " : "-100 ") + (i & 2 ? "100 " : "-100 ") +
               (i & 4 ? "100\n" : "-100\n");
    write(folder / "box.obj", box + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n");
    for (const char* scale : {"0.01", "0.001"}) {
        write(folder / "kit.toml", std::string("[[instrument]]\nname = \"box\"\nkind = \"bell\"\nsize = "
                                               "[0.2, 0.2, 0.2]\nposition = [0, 1, -0.5]\n"
                                               "mesh = \"box.obj\"\nshape = \"mesh\"\nmesh_scale = ") +
                                       scale + "\n");
        const Ended checked = run({"kit", "check", folder / "kit.toml"});
        EXPECT_EQ(checked.status, 0) << checked.err;
        EXPECT_EQ(checked.out.find("mesh_scale = 0.001 if it is in millimetres") != std::string::npos,
                  scale == std::string("0.01"))
            << scale << ": " << checked.out;
    }
}

TEST(Commands, VersionTellsBuildAndLibraries) {
    const Ended ended = run({"--version"});
    EXPECT_EQ(ended.status, 0);
    for (const char* part :
         {"musicworld 0.", "build: GCC ", "x86-64", "libraries: Eigen 3.", "Csound 6.", "CLI11 2."})
        EXPECT_TRUE(contains(ended.out, part)) << ended.out;
}

TEST(Commands, AReaderThatHasEnoughEndsThemWithoutAWord) {
    const Ended ended =
        run_command({"bash", "-c",
                     MUSICWORLD_PROGRAM
                     " predict flourish --predictor hold --lead 0.1 | head -1; echo ${PIPESTATUS[0]}"});
    EXPECT_EQ(ended.err, "");
    EXPECT_EQ(ended.out, "t,stick,px,py,pz,qw,qx,qy,qz\n141\n");  // as by SIGPIPE
}

TEST(Commands, AFullStandardOutputIsAnError) {
    if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
    const Ended ended = run_command({"bash", "-c", MUSICWORLD_PROGRAM " kit list > /dev/full"});
    EXPECT_EQ(ended.status, 1);
    EXPECT_EQ(std::count(ended.err.begin(), ended.err.end(), '\n'), 1) << ended.err;
}

TEST(Commands, AWrongFolderOfAssetsIsNamedWithItsVariable) {
    for (const std::vector<std::string>& words :
         {std::vector<std::string>{"kit", "list"}, {"trace", "info", "roll"}, {"play", "roll"}})
        expect_refused(run(words, {"MUSICWORLD_ASSETS=/nowhere"}), "MUSICWORLD_ASSETS");
    expect_refused(run({"kit", "list"}, {"MUSICWORLD_ASSETS=/nowhere"}), "/nowhere");
    EXPECT_EQ(run({"--help"}, {"MUSICWORLD_ASSETS=/nowhere"}).status, 0);
    EXPECT_EQ(run({"trace", "convert", "--help"}, {"MUSICWORLD_ASSETS=/nowhere"}).status, 0);
}

TEST(Commands, WhatTheyWroteBeforeIsReplacedAndNothingElse) {
    const Folder folder;
    const std::string kit = (folder / "kit.toml").string(), keys = (folder / "keys").string();
    write(kit, "old");
    expect_refused(run({"kit", "new", "fresh", "--out", kit}), "which is there already");
    expect_refused(run({"kit", "copy", "bells", "--out", kit}), "--force");
    expect_refused(run({"kit", "fit", "roll", "--out", kit}), "--force");
    EXPECT_EQ(read(kit), "old");
    EXPECT_EQ(run({"kit", "new", "fresh", "--force", "--out", kit}).status, 0);
    EXPECT_EQ(run({"kit", "check", kit}).status, 0);
    ASSERT_EQ(run({"keys", keys}).status, 0);
    const std::string first = read(folder / "keys/application.key");
    ASSERT_EQ(run({"keys", keys, "--workers", "a,b"}).status, 0);
    EXPECT_NE(read(folder / "keys/application.key"), first);
    EXPECT_TRUE(fs::exists(folder / "keys/b.key"));
    EXPECT_FALSE(fs::exists(folder / "keys/worker.key"));
    write(folder / "keys/notes.txt", "mine");
    expect_refused(run({"keys", keys}), "notes.txt");
    EXPECT_EQ(read(folder / "keys/notes.txt"), "mine");
    EXPECT_TRUE(fs::exists(folder / "keys/b.key"));
    expect_refused(run({"keys", kit}), "a file");
    EXPECT_FALSE(fs::exists(folder / "keys.partial"));
}

TEST(Commands, AnInterruptedRunSaysWhatStaysWhere) {
    for (const auto& [signal, words] :
         {std::pair(SIGINT, std::vector<std::string>{"simulate", "benchmark25", "--steps", "100000000"}),
          {SIGTERM, {"play", "flourish", "--size", "4096x4096"}}}) {
        const Folder folder;
        std::vector<std::string> all = words;
        all.insert(all.end(), {"--out", (folder / "played").string()});
        Started started(all, folder / "");
        for (int i = 0; i < 12000 && !fs::exists(folder / "played/.unfinished/scratch"); ++i)
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        kill(started.pid(), signal);
        const Ended ended = started.wait();
        EXPECT_EQ(ended.status, 128 + signal);
        EXPECT_TRUE(contains(ended.err, (folder / "played/.unfinished").string())) << ended.err;
    }
}

TEST(Commands, ManualAndCompletionAreThere) {
    EXPECT_TRUE(run({"manual"}).out.starts_with(".TH MUSICWORLD 1"));
    EXPECT_TRUE(contains(run({"completion", "bash"}).out, "complete -o default -F _musicworld musicworld"));
    EXPECT_TRUE(run({"completion", "zsh"}).out.starts_with("#compdef musicworld"));
    expect_refused(run({"completion", "fish"}), "fish");
}

}  // namespace
}  // namespace end_to_end
