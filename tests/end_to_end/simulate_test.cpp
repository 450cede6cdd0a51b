// musicworld simulate, as a user runs it.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "program.h"

namespace end_to_end {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const std::string kScene =
    "[[body]]\nname = \"b\"\nsize = [1, 0.4, 1]\nexponents = [0.2, 0.2]\nfidelity = \"rigid\"\n"
    "position = [0, 0.3, 0]\n[[plane]]\n";

void expect_one_line(const Ended& ended, int status, const std::string& what) {
    EXPECT_EQ(ended.status, status) << ended.err;
    EXPECT_EQ(std::count(ended.err.begin(), ended.err.end(), '\n'), 1) << ended.err;
    for (const std::string& word : {std::string("error: found "), std::string(", expected "), what})
        EXPECT_NE(ended.err.find(word), std::string::npos) << word << ": " << ended.err;
    EXPECT_EQ(ended.err.find("error: found "), ended.err.rfind("error: found "));
}

TEST(Simulate, EveryBundledSceneRunsAHundredStepsAndLosesNoBody) {
    for (const fs::directory_entry& entry : fs::directory_iterator(bundled("scenes"))) {
        if (entry.path().extension() != ".toml") continue;
        const std::string name = entry.path().stem();
        const bool large = name == "benchmark1600" || name == "benchmark400";
        const Ended ended = run({"simulate", name, "--steps", large ? "5" : "100", "--json"});
        ASSERT_EQ(ended.status, 0) << name << ended.err;
        EXPECT_EQ(ended.err, "") << name;
        const json r = json::parse(ended.out);
        EXPECT_EQ(r["bodies_lost"], 0) << name;
        EXPECT_EQ(r["scene"], entry.path().string());
    }
}

TEST(Simulate, ANewRunGivesTheSameFilesButForTimes) {
    const Folder folder;
    std::string hash;
    for (const std::string name : {"a", "b"}) {
        const Ended ended = run({"simulate", "spiked", "--steps", "30", "--out", folder / name, "--frames",
                                 "--size", "160x120", "--fps", "20", "--json"});
        ASSERT_EQ(ended.status, 0) << ended.err;
        EXPECT_TRUE(hash.empty() || json::parse(ended.out)["state_hash"] == hash);
        hash = json::parse(ended.out)["state_hash"];
    }
    const auto a = read_tree(folder / "a", {"times.csv", "summary.json"}),
               b = read_tree(folder / "b", {"times.csv", "summary.json"});
    EXPECT_EQ(a, b);
    EXPECT_EQ(a.size(), 2u + 11);  // tables; 0 to 0.5 s, 20 a second
    EXPECT_TRUE(a.contains("frames/000010.png"));
    EXPECT_NE(a.at("frames/000000.png"), a.at("frames/000010.png"));
}

TEST(Simulate, UntilRestEndsWithZeroAtRestAndWithOneWhenTheStepsDoNotSuffice) {
    const Folder folder;
    write(folder / "scene.toml", kScene);
    const Ended rest = run({"simulate", folder / "scene.toml", "--until", "rest"});
    EXPECT_EQ(rest.status, 0) << rest.err;
    const Ended early = run({"simulate", folder / "scene.toml", "--until", "rest", "--steps", "5", "--json"});
    expect_one_line(early, 1, "1 of 1 body awake after 5 steps");
    EXPECT_EQ(json::parse(early.out)["at_rest"], false);
}

TEST(Simulate, AVideoIsMadeWithFramesThatAreKeptIfAskedFor) {
    const Folder folder;
    write(folder / "scene.toml", kScene);
    const std::vector<std::string> words = {
        "simulate", folder / "scene.toml", "--steps", "30",   "--out", folder / "out",
        "--video",  folder / "fall.mp4",   "--size",  "96x64"};
    const Ended ended = run(words);
    EXPECT_EQ(ended.status, 0) << ended.err;
    EXPECT_NE(ended.out.find("Watch " + (folder / "fall.mp4").string()), std::string::npos) << ended.out;
    EXPECT_EQ(ended.out.find("frames"), std::string::npos) << ended.out;
    const std::string video = read(folder / "fall.mp4");
    EXPECT_EQ(video.substr(4, 4), "ftyp");
    EXPECT_FALSE(fs::exists(folder / "out" / "frames"));
    std::vector<std::string> kept = words;
    kept.emplace_back("--frames");
    EXPECT_EQ(run(kept).status, 0);
    EXPECT_TRUE(fs::exists(folder / "out" / "frames" / "000015.png"));
    EXPECT_EQ(read(folder / "fall.mp4"), video);
}

TEST(Simulate, WrongScenesAreRefusedWithTheirPlaceAndNothingIsWritten) {
    const Folder folder;
    const std::vector<std::pair<std::string, std::string>> cases = {
        {"", ":1:1: error: found no [[body]]"},
        {"\x7f"
         "ELF",
         ":1:1: error: found a syntax error"},
        {kScene + "[[body]\n", ":8:"},
        {kScene + "[[body]]\nname = \"b\"\nradius = 1\n", ":8:1: error: found a second body"},
        {kScene + "[[constraint]]\nbody = \"none\"\n", ":9:8: error: found body = \"none\""},
        {kScene + "[settings]\ndt = 1\n", ":9:6: error: found dt = 1"},
        {kScene + "frction = 1\n", ":8:1: error: found unknown key"},
    };
    for (const auto& [text, words] : cases) {
        write(folder / "scene.toml", text);
        expect_one_line(run({"simulate", folder / "scene.toml", "--out", folder / "out"}), 2, words);
        EXPECT_FALSE(fs::exists(folder / "out"));
    }
    expect_one_line(run({"simulate", folder / "none.toml"}), 2, "no such file");
    expect_one_line(run({"simulate", folder / "."}), 2, "found a directory");
}

TEST(Simulate, WrongOptionsAreRefusedInOneLine) {
    const Folder folder;
    const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
        {{"--workers", "-1"}, "--workers -1"},
        {{"--mode", "async"}, "found --mode, which is gone, expected --bound B"},
        {{"--workers", "2", "--verify=2"}, "found --verify, which is gone, expected --bound B"},
        {{"--bound", "3"}, "--bound 3"},
        {{"--steps", "-5"}, "--steps -5"},
        {{"--dt", "0"}, "--dt 0"},
        {{"--dt", "1/0"}, "--dt"},
        {{"--seconds", "nan"}, "--seconds"},
        {{"--until", "dawn"}, "--until dawn"},
        {{"--frames"}, "without --out"},
        {{"--fps", "0"}, "--fps 0"},
        {{"--frames", "--out", folder / "out", "--size", "1x1"}, "--size 1x1"},
    };
    for (const auto& [options, words] : cases) {
        std::vector<std::string> arguments = {"simulate", "human"};
        arguments.insert(arguments.end(), options.begin(), options.end());
        expect_one_line(run(arguments), 2, words);
    }
}

TEST(Simulate, WorkerProcessesGiveFilesLikeThoseOfOneProcess) {
    const Folder folder;
    write(folder / "scene.toml", kScene + "[[body]]\nname = \"c\"\nradius = 0.3\nposition = [0.2, 0.9, 0]\n");
    for (const std::string workers : {"0", "1", "2"}) {
        const Ended ended = run({"simulate", folder / "scene.toml", "--steps", "40", "--workers", workers,
                                 "--out", folder / workers, "--frames", "--size", "96x64", "--json"});
        ASSERT_EQ(ended.status, 0) << ended.err;
        EXPECT_EQ(ended.err, "");
        const json r = json::parse(ended.out);
        EXPECT_EQ(r["workers"], std::stoi(workers));
        EXPECT_EQ(r["steps"], 40);
    }
    const auto names_in = [&](const std::string& workers) {
        std::vector<std::string> names;
        for (const auto& [name, content] :
             read_tree(folder / workers, {"times.csv", "timing.csv", "workers.svg"}))
            names.push_back(name + " of " +
                            std::to_string(std::ranges::count(content, '\n') * (name.ends_with(".csv"))));
        return names;
    };
    EXPECT_EQ(names_in("1"), names_in("0"));  // tables of as many rows
    EXPECT_EQ(names_in("2"), names_in("0"));
    EXPECT_TRUE(fs::exists(folder / "2" / "timing.csv"));
}

/// A body that rises at 10^4 m/s^2, so that it is out of the world's range, 1e7 m, after 44.72 s; one that hits
/// the floor too hard for its stiffness; and one that hangs on a hook that its weight breaks.
const std::string kMishaps =
    "[settings]\ndt = 0.1\nseconds = 48\ngravity = [0, -1000, 0]\n[[plane]]\n"
    "[defaults]\nfidelity = \"rigid\"\ngravity_scale = 0.01\n"
    "[material.soft]\nyoung_pa = 1e4\ndensity_kg_m3 = 1000\n"
    "[[body]]\nname = \"far\"\nradius = 0.5\nposition = [0, 5, 9]\ngravity_scale = -10\n"
    "[[body]]\nname = \"soft\"\nradius = 0.5\nmaterial = \"soft\"\nfidelity = \"modal\"\n"
    "position = [0, 0.6, 0]\nvelocity = [0, -20, 0]\n"
    "[[body]]\nname = \"heavy\"\nradius = 0.5\nposition = [5, 20, 0]\n"
    "[[constraint]]\nname = \"hook\"\nbody = \"heavy\"\npoint = [0, 0.5, 0]\nbreaking_force = 10\n";

const char* const kMishapLines[] = {
    "1 body taken out (beyond the world's range or not finite): far (position); first at step 448\n",
    "1 constraint broken (above the breaking force): hook; first at step ",
    "1 body held at the limit of deformation: soft; first at step "};

const std::string kTakenOut = "error: found 1 body taken out, expected none";

TEST(Simulate, WhatIsTakenOutBreaksOrIsHeldAtItsLimitIsSaidAndABodyTakenOutEndsWithOne) {
    const Folder folder;
    write(folder / "scene.toml", kMishaps);
    const Ended ended = run({"simulate", folder / "scene.toml", "--out", folder / "out"});
    expect_one_line(ended, 1, kTakenOut);
    const json summary = json::parse(read(folder / "out" / "summary.json"));
    for (const char* line : kMishapLines) {
        EXPECT_NE(ended.out.find(line), std::string::npos) << line << ": " << ended.out;
        EXPECT_NE(summary["notes"].dump().find(std::string(line, 40)), std::string::npos) << summary["notes"];
    }
    EXPECT_EQ(summary["notes"].size(), 3u);
    EXPECT_EQ(summary["quarantined"], json::parse(R"([{"body": "far", "step": 448, "what": "position"}])"));
    EXPECT_EQ(summary["constraints_broken"][0]["constraint"], "hook");
    EXPECT_EQ(summary["held_at_limit"][0]["body"], "soft");

    const Ended allowed = run({"simulate", folder / "scene.toml", "--allow-quarantine", "--json"});
    EXPECT_EQ(allowed.status, 0);
    EXPECT_EQ(allowed.err, "");
    EXPECT_EQ(json::parse(allowed.out)["notes"], summary["notes"]);
}

TEST(Simulate, WorkersSayTheSameOfTheirBodies) {
    const Folder folder;
    write(folder / "scene.toml", kMishaps);
    const Ended alone = run({"simulate", folder / "scene.toml", "--json"});
    const json expected = json::parse(alone.out);
    for (const char* bound : {"0", "2"}) {
        std::vector<std::string> arguments = {"simulate", folder / "scene.toml", "--workers", "2", "--bound",
                                              bound};
        const Ended words = run(arguments);
        expect_one_line(words, 1, kTakenOut);
        for (const char* line : kMishapLines)
            EXPECT_NE(words.out.find(line), std::string::npos) << line << ": " << words.out;
        arguments.insert(arguments.end(), {"--json", "--allow-quarantine"});
        const Ended ended = run(arguments);
        EXPECT_EQ(ended.status, 0) << ended.err;
        const json r = json::parse(ended.out);
        for (const char* key : {"quarantined", "constraints_broken", "held_at_limit", "bodies_lost"})
            EXPECT_EQ(r[key], expected[key]) << key;
    }
}

TEST(Simulate, WorkersWithThreadsFinishAndSimulatedProcessorsHaveNone) {
    const std::vector<std::string> scene = {"simulate", "benchmark100", "--steps", "40", "--json"};
    const auto run_with = [&scene](const std::vector<std::string>& more) {
        std::vector<std::string> words = scene;
        words.insert(words.end(), more.begin(), more.end());
        const Ended ended = run(words);
        EXPECT_EQ(ended.status, 0) << ended.err;
        return json::parse(ended.out);
    };
    const json apart = run_with({"--workers", "2", "--threads", "3"});
    EXPECT_EQ(apart["workers_lost"], 0);
    EXPECT_EQ(apart["steps"], 40);
    std::vector<std::string> simulated = scene;
    simulated.insert(simulated.end(), {"--workers", "2", "--threads", "3", "--processors", "simulated"});
    expect_refused(run(simulated), "--threads 3");
}

TEST(Simulate, TheLinesThatItPrintsForWorkersElsewhereMakeThemJoin) {
    const Folder folder;
    write(folder / "scene.toml", kScene);
    ASSERT_EQ(run({"keys", folder / "keys", "--workers", "left,right"}).status, 0);
    const std::string script =
        "cd $FOLDER; $PROGRAM simulate scene.toml --steps 5 --listen tcp://127.0.0.1:0 --keys keys --expect "
        "2 "
        "--json > out 2> err & "
        // `err` may not be there yet: then grep says nothing at all.
        "until [ \"$(grep -c '^listening: ' err 2> none)\" = 2 ]; do kill -0 $! || exit 1; sleep 0.02; done; "
        "sed -n 's/^listening: musicworld //p' err > lines; "
        "while read -r words; do $PROGRAM $words & done < lines; wait";
    const Ended ended = run_command({"bash", "-c", script}, {"FOLDER=" + (folder / "").string(),
                                                             std::string("PROGRAM=") + MUSICWORLD_PROGRAM});
    EXPECT_EQ(ended.status, 0) << ended.err << read(folder / "err");
    EXPECT_EQ(json::parse(read(folder / "out"))["workers"], 2);
    EXPECT_NE(read(folder / "lines").find("--key keys/left.key"), std::string::npos);
}

TEST(Simulate, GoesOnWithFewerThreadsWhereTheSystemStartsNoMore) {
#ifdef MUSICWORLD_SANITIZED
    GTEST_SKIP() << "sanitizers need more memory than is left here";
#endif
    const Folder folder;
    write(folder / "scene.toml", kScene);
    const Ended ended =
        run_command({"bash", "-c",
                     "ulimit -v 1500000; exec " MUSICWORLD_PROGRAM " simulate " +
                         (folder / "scene.toml").string() + " --steps 5 --threads 256 --json"});
    ASSERT_EQ(ended.status, 0) << ended.err;
    EXPECT_EQ(
        json::parse(ended.out)["state_hash"],
        json::parse(run({"simulate", folder / "scene.toml", "--steps", "5", "--json"}).out)["state_hash"]);
}

}  // namespace
}  // namespace end_to_end
