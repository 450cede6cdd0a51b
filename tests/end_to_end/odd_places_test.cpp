// Devices, pipes, links, closed streams, names that are no text, missing tools: what was asked for is there, or one
// line says why not, and nothing of others is harmed.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "program.h"

namespace end_to_end {
namespace {

namespace fs = std::filesystem;

const std::string kProgram = MUSICWORLD_PROGRAM;

Ended shell(const std::string& command) {
    return run_command({"bash", "-c", command});
}

void make_pipe(const fs::path& file) {
    ASSERT_EQ(mkfifo(file.c_str(), 0600), 0);
}

/// A folder of programs that a signal kills at once.
std::string killed(const Folder& folder, const std::vector<std::string>& programs) {
    const fs::path bin = folder / "bin";
    fs::create_directory(bin);
    for (const std::string& name : programs) {
        write(bin / name, "#!/bin/sh\nkill -9 $$\n");
        fs::permissions(bin / name, fs::perms::owner_all);
    }
    return "PATH=" + bin.string() + ":" + std::getenv("PATH");
}

std::vector<std::string> names_in(const fs::path& folder) {
    std::vector<std::string> names;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder))
        names.push_back(entry.path().filename().string());
    std::ranges::sort(names);
    return names;
}

using Names = std::vector<std::string>;

/// Commands that write one file, and what they say before its name.
const std::vector<std::vector<std::string>> kWriters = {
    {"trace", "synth", "feints", "--out"},
    {"predict", "flourish", "--predictor", "hold", "--lead", "0.1", "--out"},
    {"kit", "new", "mine", "--force", "--out"},
    {"trace", "convert", bundled("traces/roll.csv"), "--out"},
    {"record", "--source", "trace:" + bundled("traces/roll.csv").string(), "--speed", "1000", "--out"},
};

TEST(OddPlaces, LinksAreFollowedAndDevicesAndPipesWrittenTo) {
    const Folder folder;
    for (const std::vector<std::string>& writer : kWriters) {
        SCOPED_TRACE(writer[0] + " " + writer[1]);
        const auto written_to = [&](const std::string& out) {
            std::vector<std::string> words = writer;
            words.push_back(out);
            const Ended ended = run(words);
            EXPECT_EQ(ended.status, 0) << ended.err;
        };
        const fs::path plain = folder / "plain", target = folder / "target", link = folder / "link";
        written_to(plain);
        write(target, "old");
        fs::create_symlink("target", link);
        written_to(link);
        EXPECT_TRUE(fs::is_symlink(link));
        EXPECT_EQ(read(target), read(plain));
        fs::remove(link);
        fs::create_symlink("/dev/null", link);
        written_to(link);
        EXPECT_TRUE(fs::is_symlink(link));
        EXPECT_TRUE(fs::is_character_file("/dev/null"));
        fs::remove(link);

        make_pipe(folder / "pipe");
        std::string words;
        for (const std::string& word : writer) words += "'" + word + "' ";
        const Ended piped =
            shell("cat '" + (folder / "pipe").string() + "' & " + kProgram + " " + words + "'" +
                  (folder / "pipe").string() + "' >/dev/null; status=$?; wait; exit $status");
        EXPECT_EQ(piped.status, 0) << piped.err;
        EXPECT_EQ(piped.out, read(plain));
        EXPECT_TRUE(fs::is_fifo(folder / "pipe"));
        fs::remove(folder / "pipe");
        EXPECT_EQ(names_in(folder / "."), (Names{"plain", "target"})) << "nothing else is left";
    }
}

TEST(OddPlaces, StandardOutputByNameComesBehindWhatWasPrinted) {
    const Folder folder;
    const std::string out = (folder / "out").string();
    const Ended ended = shell(kProgram + " trace convert " + bundled("traces/roll.csv").string() +
                              " --out /dev/stdout > " + out);
    EXPECT_EQ(ended.status, 0) << ended.err;
    EXPECT_TRUE(read(out).find("\nt,stick,") != std::string::npos) << read(out).substr(0, 200);
    EXPECT_TRUE(read(out).find("/dev/stdout: ") != std::string::npos)
        << "what the command says is there, too";
}

TEST(OddPlaces, ProductsOfAFolderFollowTheSameRules) {
    const Folder folder;
    const fs::path out = folder / "out", elsewhere = folder / "elsewhere";
    fs::create_directories(out);
    fs::create_directories(elsewhere / "pictures");
    write(elsewhere / "sound.wav", "old");
    write(elsewhere / "pictures/000000.png", "old");
    fs::create_symlink(elsewhere / "sound.wav", out / "audio.wav");
    fs::create_symlink(elsewhere / "pictures", out / "frames");
    fs::create_symlink("/dev/null", out / "events.csv");
    const std::vector<std::string> play = {"play", "roll", "--size", "32x32", "--fps", "5", "--out", out};
    const Ended ended = run(play);
    ASSERT_EQ(ended.status, 0) << ended.err;
    for (const char* name : {"audio.wav", "frames", "events.csv"})
        EXPECT_TRUE(fs::is_symlink(out / name)) << name;
    EXPECT_TRUE(fs::is_character_file("/dev/null"));
    EXPECT_GT(fs::file_size(elsewhere / "sound.wav"), 10000u);
    EXPECT_TRUE(read(elsewhere / "pictures/000000.png").starts_with("\x89PNG"));
    EXPECT_TRUE(fs::exists(out / "summary.json"));

    fs::remove(out / "hits.mid");
    fs::create_directory(out / "hits.mid");
    write(out / "hits.mid/mine", "mine");
    expect_refused(run(play), "found a folder where the run's file is to be");
    EXPECT_EQ(read(out / "hits.mid/mine"), "mine");
}

TEST(OddPlaces, WhatCanBeNoOutputIsRefusedBeforeTheWork) {
    const Folder folder;
    fs::create_directory(folder / "taken");
    fs::create_symlink("circle", folder / "circle");
    for (const std::string& out :
         {(folder / "taken").string(), (folder / "circle").string(), (folder / "nowhere/x").string(),
          (folder / std::string(300, 'n')).string()})
        for (std::vector<std::string> writer : kWriters) {
            writer.push_back(out);
            expect_refused(run(writer), "found");
        }
    for (const std::string& video : {(folder / "taken").string(), (folder / "nowhere/x.mp4").string()}) {
        expect_refused(
            run({"simulate", "joints", "--steps", "2", "--out", folder / "out", "--video", video}));
        expect_refused(run({"play", "roll", "--out", folder / "out", "--video", video}));
    }
    EXPECT_EQ(names_in(folder / "."), (Names{"circle", "taken"}));
    // 250 bytes are a name, though not with .partial behind them.
    const std::string longest(250, 'n');
    EXPECT_EQ(run({"kit", "new", "mine", "--out", folder / longest}).status, 0);
    EXPECT_TRUE(fs::exists(folder / longest));
}

TEST(OddPlaces, InputsAreFilesOrPipesThatSomebodyWrites) {
    const Folder folder;
    for (const std::vector<std::string>& reader :
         {Names{"kit", "check"}, {"simulate"}, {"trace", "info"}, {"play", "roll", "--kit"}}) {
        std::vector<std::string> words = reader;
        words.emplace_back("/dev/zero");
        expect_refused(run(words), "found a device");
    }
    make_pipe(folder / "pipe");
    expect_refused(run({"trace", "info", folder / "pipe"}), "found a pipe that nobody writes into");
    const std::string trace = bundled("traces/roll.csv").string(), out = (folder / "out").string();
    const Ended piped = shell("(sleep 0.3; cat " + trace + ") | " + kProgram +
                              " play /dev/stdin --no-frames --no-audio --out " + out);
    EXPECT_EQ(piped.status, 0) << piped.err;
    const std::string sum = shell("sha256sum < " + trace).out.substr(0, 64);
    EXPECT_NE(read(out + "/summary.json").find(sum), std::string::npos) << "the bytes that were played";
}

TEST(OddPlaces, MarksThatCannotBeReadAreAnError) {
    const Folder folder;
    fs::copy_file(bundled("traces/roll.csv"), folder / "take.csv");
    const std::vector<std::string> compare = {"compare",      (folder / "take.csv").string(),
                                              "--predictors", "hold,ca",
                                              "--leads",      "1/30",
                                              "--no-tuning",  "--no-cost",
                                              "--out",        (folder / "out").string()};
    fs::create_directory(folder / "take.hits.csv");
    expect_refused(run(compare), "take.hits.csv");
    fs::remove(folder / "take.hits.csv");
    fs::create_symlink("take.flags.csv", folder / "take.flags.csv");
    expect_refused(run(compare), "take.flags.csv");
    EXPECT_FALSE(fs::exists(folder / "out"));
}

TEST(OddPlaces, AStandardErrorThatIsClosedOrFullChangesNothingElse) {
    const Folder folder;
    const std::string out = (folder / "out").string();
    for (const std::string error : {"2>&-", "2>/dev/full", "2>&- >&- <&-"}) {
        EXPECT_EQ(shell(kProgram + " kit check /nowhere.toml " + error).status, 2) << error;
        // A note on standard error, then the results.
        EXPECT_EQ(
            shell(kProgram + " play roll --no-frames --realtime --seconds 0.5 --out " + out + " " + error)
                .status,
            error.find(">&- <") == std::string::npos ? 0 : 1)
            << error;
        EXPECT_TRUE(fs::exists(out + "/summary.json")) << error;
        fs::remove_all(out);
    }
}

TEST(OddPlaces, MessagesHoldNoBytesThatATerminalMightObey) {
    const Ended ended = run({"kit", "check", "/no\x1b[31m\xff\xc2\x9b.toml"});
    EXPECT_EQ(ended.status, 2);
    EXPECT_TRUE(std::ranges::all_of(ended.err, [](char c) { return c == '\n' || (c >= ' ' && c <= '~'); }))
        << ended.err;
}

TEST(OddPlaces, NamesThatAreNoTextStandInDocuments) {
    const Folder folder;
    const std::string scene = (folder / "sc\xff.toml").string(), trace = (folder / "t\xff.csv").string(),
                      kit = (folder / "k\xff.toml").string();
    fs::copy_file(bundled("scenes/joints.toml"), scene);
    fs::copy_file(bundled("traces/roll.csv"), trace);
    fs::copy_file(bundled("kits/drums.toml"), kit);
    const auto is_document = [](const Ended& ended) {
        EXPECT_EQ(ended.status, 0) << ended.err;
        EXPECT_TRUE(nlohmann::json::accept(ended.out)) << ended.out.substr(0, 300);
    };
    is_document(run({"simulate", scene, "--steps", "3", "--json", "--out", folder / "out"}));
    EXPECT_TRUE(nlohmann::json::accept(read(folder / "out/summary.json")));
    is_document(run({"trace", "info", "--json", trace}));
    EXPECT_EQ(run({"play", trace, "--kit", kit, "--no-frames", "--no-audio", "--out", folder / "p"}).status,
              0);
    EXPECT_TRUE(nlohmann::json::accept(read(folder / "p/summary.json")));
    EXPECT_EQ(run({"compare", trace, "--predictors", "hold,ca", "--leads", "1/30", "--no-tuning", "--no-cost",
                   "--out", folder / "c"})
                  .status,
              0);
    EXPECT_TRUE(nlohmann::json::accept(read(folder / "c/compare.json")));
}

/// Each part is a table within the one before: destroying them took a stack frame each.
TEST(OddPlaces, AKeyOfManyPartsIsRefusedInEveryFormat) {
    const Folder folder;
    std::string key = "a";
    for (int i = 0; i < 300000; ++i) key += ".a";
    for (const std::string& text :
         {key + " = 1\n", "[" + key + "]\n", "[[" + key + "]]\n", "x = {" + key + " = 1}\n"}) {
        write(folder / "deep.toml", text);
        const std::string file = (folder / "deep.toml").string();
        for (const std::vector<std::string>& reader :
             {Names{"kit", "check", file},
              {"simulate", file},
              {"trace", "convert", bundled("traces/roll.csv"), "--map", file, "--out", folder / "x"}})
            expect_refused(run(reader), "deep.toml:1:");
    }
}

TEST(OddPlaces, AMeshThatCannotBeLoadedIsBadInputAndChecked) {
    const Folder folder;
    write(folder / "bad.obj", "no mesh\n");
    write(folder / "passwd", "root:x:0:0\n");
    for (const std::string mesh : {"bad.obj", "passwd", "../../../../../../etc/passwd"}) {
        write(folder / "kit.toml",
              "[[instrument]]\nname = \"a\"\nkind = \"drum\"\nsize = [0.3, 0.2, 0.3]\nposition = [0, 0.7, "
              "-0.4]\n"
              "mesh = \"" +
                  mesh + "\"\n");
        for (const std::vector<std::string>& command :
             {Names{"kit", "check", folder / "kit.toml"},
              {"kit", "draw", folder / "kit.toml", "--out", folder / "k.png"},
              {"play", "roll", "--kit", folder / "kit.toml", "--no-audio", "--out", folder / "out"}})
            expect_refused(run(command), fs::path(mesh).filename().string());
    }
    EXPECT_FALSE(fs::exists(folder / "out"));
}

TEST(OddPlaces, ResultsStandWhenPlotsOrTheVideoFail) {
    const Folder folder;
    const std::string path = killed(folder, {"gnuplot", "ffmpeg"}), out = (folder / "out").string();
    const auto fails_but_leaves = [&](std::vector<std::string> words, const Names& products) {
        SCOPED_TRACE(words[0]);
        words.insert(words.end(), {"--out", out});
        const Ended ended = run(words, {path});
        EXPECT_EQ(ended.status, 1);
        EXPECT_EQ(std::count(ended.err.begin(), ended.err.end(), '\n'), 1) << ended.err;
        EXPECT_NE(ended.err.find("all else is in " + out), std::string::npos) << ended.err;
        EXPECT_FALSE(ended.out.empty());
        EXPECT_EQ(names_in(out), products);
        fs::remove_all(out);
    };
    const std::string video = (folder / "v.mp4").string();
    fails_but_leaves(
        {"play", "roll", "--size", "32x32", "--fps", "5", "--video", video},
        {"audio.wav", "contacts.csv", "events.csv", "frames", "hits.mid", "report.html", "summary.json"});
    fails_but_leaves({"simulate", "joints", "--steps", "9", "--workers", "2"},
                     {"energy.csv", "states.csv", "summary.json", "timing.csv"});
    fails_but_leaves({"simulate", "joints", "--steps", "9", "--size", "32x32", "--video", video},
                     {"energy.csv", "frames", "states.csv", "summary.json", "times.csv"});
    fails_but_leaves({"compare", bundled("traces/roll.csv"), "--predictors", "hold,ca", "--leads", "1/30",
                      "--no-tuning", "--no-cost"},
                     {"compare.csv", "compare.json", "experiment.toml", "figures", "report.html"});
    EXPECT_EQ(names_in(folder / "."), (Names{"bin"})) << "no half a video";
}

TEST(OddPlaces, AToolThatDiesHalfWayHarmsNoOlderVideoAndIsAskedAgainForFigures) {
    const Folder folder;
    fs::create_directory(folder / "bin");
    const auto program = [&](const std::string& name, const std::string& lines) {
        write(folder / "bin" / name, "#!/bin/sh\n" + lines);
        fs::permissions(folder / "bin" / name, fs::perms::owner_all);
    };
    const std::string path = "PATH=" + (folder / "bin").string() + ":" + std::getenv("PATH");
    const fs::path out = folder / "out", video = folder / "v.mp4";
    program("ffmpeg", "for file; do :; done\necho half > \"$file\"\nkill -9 $$\n");
    write(video, "whole");
    for (const Names& words : {Names{"play", "roll", "--size", "32x32", "--fps", "5"},
                               Names{"simulate", "joints", "--steps", "9", "--size", "32x32"}}) {
        Names all = words;
        all.insert(all.end(), {"--video", video, "--out", out});
        EXPECT_EQ(run(all, {path}).status, 1);
        EXPECT_EQ(read(video), "whole") << words[0];
        EXPECT_EQ(names_in(folder / "."), (Names{"bin", "out", "v.mp4"}));
    }
    program("gnuplot", "if [ ! -e '" + (folder / "bin/asked").string() + "' ]; then touch '" +
                           (folder / "bin/asked").string() +
                           "'; exit 0; fi\nPATH=${PATH#*:} exec gnuplot \"$@\"\n");
    const Ended ended = run({"compare", bundled("traces/roll.csv"), "--predictors", "hold,ca", "--leads",
                             "1/30", "--no-tuning", "--no-cost", "--out", folder / "compared"},
                            {path});
    EXPECT_EQ(ended.status, 0) << ended.err;
    const Names figures = names_in(folder / "compared/figures");
    EXPECT_GE(figures.size(), 4u);
    EXPECT_EQ(figures.size() % 2, 0u);
    for (const std::string& figure : figures)
        EXPECT_GT(fs::file_size(folder / "compared/figures" / figure), 500u);
}

TEST(OddPlaces, ToolsThatTheEndWillNeedAreLookedForFirst) {
    const Folder folder;
    fs::create_directory(folder / "bin");
    const std::string path = "PATH=" + (folder / "bin").string(), out = (folder / "out").string();
    for (const std::vector<std::string>& words :
         {Names{"play", "roll", "--out", out},
          {"simulate", "joints", "--steps", "9", "--workers", "2", "--out", out},
          {"simulate", "joints", "--steps", "9", "--video", folder / "v.mp4", "--out", out},
          {"compare", bundled("traces/roll.csv"), "--predictors", "hold,ca", "--out", out}})
        expect_refused(run(words, {path}), "not found on PATH", 1);
    EXPECT_EQ(names_in(folder / "."), (Names{"bin"}));
    EXPECT_EQ(run({"simulate", "joints", "--steps", "9", "--out", out}, {path}).status, 0) << "needs neither";
}

TEST(OddPlaces, TooFewDescriptorsAreSaidAndNotDiedOf) {
    const Folder folder;
    for (int limit = 8; limit < 96; limit += 8) {
        const fs::path out = folder / "out";
        const Ended ended =
            shell("ulimit -n " + std::to_string(limit) + "; " + kProgram +
                  " simulate joints --steps 9 --workers 2 --frames --size 16x16 --out " + out.string());
        EXPECT_EQ(ended.status, limit < 64 ? 1 : 0) << limit << ": " << ended.err;
        EXPECT_EQ(fs::exists(out), limit >= 64) << limit;
    }
}

TEST(OddPlaces, AHangUpEndsARunInOrder) {
    const Folder folder;
    const std::string start =
        // Whoever runs the tests may ignore hang-ups (nohup), and their children then do, too.
        "env --default-signal=HUP TMPDIR=" + (folder / ".").string() + " " + kProgram +
        " latency flourish --no-frames --seconds 600 & program=$!; "
        "until ls -d '" +
        (folder / ".").string() +
        "'/musicworld_latency_*/.unfinished; do kill -0 $program && sleep 0.1 || exit 3; done; "
        "sleep 1; "
        "kill -HUP $program; wait $program";
    EXPECT_NE(shell(start).status, 3) << "the program ended by itself";
    EXPECT_EQ(names_in(folder / "."), Names{});
}

TEST(OddPlaces, VariablesOfMesaChangeNoPicture) {
    const Folder folder;
    const auto picture = [&](const std::vector<std::string>& environment) {
        const Ended ended =
            run({"kit", "draw", "drums", "--size", "64x48", "--out", folder / "k.png"}, environment);
        EXPECT_EQ(ended.status, 0) << ended.err;
        return read(folder / "k.png");
    };
    const std::string plain = picture({});
    for (const char* variable : {"GALLIUM_DRIVER=softpipe", "MESA_GL_VERSION_OVERRIDE=2.1",
                                 "LP_NATIVE_VECTOR_WIDTH=128", "MESA_NO_DITHER=1", "LP_NUM_THREADS=1"})
        EXPECT_EQ(picture({variable}), plain) << variable;
}

}  // namespace
}  // namespace end_to_end
