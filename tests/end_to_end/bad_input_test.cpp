// Whatever is wrong with the input: one line that says where and what, status 2 (1 while running), and no
// file that looks finished.
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>

#include "program.h"

namespace end_to_end {
namespace {

namespace fs = std::filesystem;

const std::string kHeader = "t,stick,px,py,pz,qw,qx,qy,qz\n";
const std::string kGood = "0,r,0,1,0,1,0,0,0\n0.01,r,0,1,0,1,0,0,0\n0.02,r,0,1,0,1,0,0,0\n";

void expect_refused(const Ended& ended, const std::string& what, const std::string& place, int status = 2) {
    SCOPED_TRACE(what);
    end_to_end::expect_refused(ended, place, status);
}

void expect_nothing_finished(const fs::path& out) {
    if (!fs::exists(out) || !fs::is_directory(out)) return;
    for (const fs::directory_entry& entry : fs::directory_iterator(out))
        EXPECT_TRUE(entry.path().filename().string().starts_with('.')) << entry.path();
}

struct Case {
    std::string what, text, place;
};

TEST(BadInput, TracesOfThirtyKindsAreRefusedWithTheirPlace) {
    const std::string row = "0.03,r,0,1,0,1,0,0,0\n";
    const std::vector<Case> cases = {
        {"empty", "", ":1"},
        {"binary",
         std::string("\x7f"
                     "ELF\0\1\2\3\0\0",
                     10),
         ":1"},
        {"only comments", "# units: m\n", "trace.csv"},
        {"no rows", kHeader, "trace.csv"},
        {"missing column", "t,stick,px,py\n0,r,0,0\n1,r,0,0\n", ":1:"},
        {"half a quaternion", "t,stick,px,py,pz,qw,qx\n0,r,0,0,0,1,0\n", ":1:"},
        {"unknown column", "t,stick,px,py,pz,colour\n0,r,0,0,0,1\n", ":1:"},
        {"repeated column", "t,stick,px,px,py,pz\n0,r,0,0,0,0\n", ":1:"},
        {"NaN position", kHeader + "0,r,nan,1,0,1,0,0,0\n" + row, ":2:5:"},
        {"infinite position", kHeader + "0,r,inf,1,0,1,0,0,0\n" + row, ":2:5:"},
        {"NaN time", kHeader + "nan,r,0,1,0,1,0,0,0\n" + row, ":2:1:"},
        {"1e300", kHeader + "0,r,1e300,1,0,1,0,0,0\n" + row, ":2:5:"},
        {"1e400", kHeader + "0,r,1e400,1,0,1,0,0,0\n" + row, ":2:5:"},
        {"huge time", kHeader + "1e9,r,0,1,0,1,0,0,0\n" + row, ":2:1:"},
        {"time goes back", kHeader + kGood + "0.015,r,0,1,0,1,0,0,0\n", ":5:1:"},
        {"time repeats", kHeader + kGood + "0.02,r,0,1,0,1,0,0,0\n", ":5:1:"},
        {"zero quaternion", kHeader + "0,r,0,1,0,0,0,0,0\n" + row, ":2:"},
        {"long quaternion", kHeader + "0,r,0,1,0,2,0,0,0\n" + row, ":2:"},
        {"NaN quaternion", kHeader + "0,r,0,1,0,nan,0,0,0\n" + row, ":2:11:"},
        {"too few fields", kHeader + "0,r,0,1\n" + row, ":2:"},
        {"too many fields", kHeader + "0,r,0,1,0,1,0,0,0,7\n" + row, ":2:"},
        {"a word for a number", kHeader + "0,r,left,1,0,1,0,0,0\n" + row, ":2:5:"},
        {"a number with a tail", kHeader + "0,r,1.0x,1,0,1,0,0,0\n" + row, ":2:5:"},
        {"empty field", kHeader + "0,r,,1,0,1,0,0,0\n" + row, ":2:5:"},
        {"no stick name", kHeader + "0,,0,1,0,1,0,0,0\n" + row, ":2:3:"},
        {"one sample of a stick", kHeader + "0,r,0,1,0,1,0,0,0\n", "trace.csv"},
        {"unknown unit", "# units: furlong\n" + kHeader + kGood, ":1:"},
        {"unknown axis", "# up: x\n" + kHeader + kGood, ":1:"},
        {"bad tip", "# tip_m: 0,0\n" + kHeader + kGood, ":1:"},
        {"bad shaft", "# shaft: down\n" + kHeader + kGood, ":1:"},
        {"bad rate", "# rate_hz: fast\n" + kHeader + kGood, ":1:"},
        {"a null byte", kHeader + std::string("0,r,0,1,0,1,0,0,\0\n", 18) + row, ":2:"},
        {"semicolons", "t;stick;px;py;pz\n0;r;0;0;0\n", ":1:"},
        {"spaces as a line", kHeader + "   \n" + kGood, ":2:"},
    };
    const Folder folder;
    for (const Case& c : cases) {
        write(folder / "trace.csv", c.text);
        const Ended ended =
            run({"play", (folder / "trace.csv").string(), "--out", (folder / "out").string(), "--no-frames"});
        expect_refused(ended, c.what, c.place);
        expect_nothing_finished(folder / "out");
    }
}

TEST(BadInput, KitsOfManyKindsAreRefusedWithTheirPlace) {
    const std::string good =
        "[[instrument]]\nname = \"a\"\nkind = \"drum\"\nsize = [0.3, 0.1, 0.3]\nposition = [0, 0.7, 0]\n";
    const std::vector<Case> cases = {
        {"empty", "", "kit.toml:1:1"},
        {"binary", std::string("\x89PNG\0\0", 6), "kit.toml:1:"},
        {"syntax", "[[instrument\n", "kit.toml:1:"},
        {"unknown key", good + "colour = \"red\"\n", "kit.toml:6:1"},
        {"unknown table", good + "[lights]\nx = 1\n", "kit.toml:6:"},
        {"unknown kind", "[[instrument]]\nname = \"a\"\nkind = \"kazoo\"\n", "kit.toml:3:"},
        {"no name", "[[instrument]]\nkind = \"drum\"\n", "kit.toml:1:"},
        {"negative size",
         "[[instrument]]\nname = \"a\"\nkind = \"drum\"\nsize = [-1, 0.1, 0.3]\nposition = [0, 1, 0]\n",
         "kit.toml:4:"},
        {"two numbers",
         "[[instrument]]\nname = \"a\"\nkind = \"drum\"\nsize = [1, 1]\nposition = [0, 1, 0]\n",
         "kit.toml:4:"},
        {"text for a number", good + "restitution = \"much\"\n", "kit.toml:6:"},
        {"nan", good + "restitution = nan\n", "kit.toml:6:"},
        {"missing mesh", good + "mesh = \"nowhere.obj\"\n", "kit.toml:6:"},
        {"missing include", "include = [\"nowhere.toml\"]\n" + good, "kit.toml:1:"},
        {"same name twice", good + good, "kit.toml:"},
        {"zero quaternion", good + "orientation = [0, 0, 0, 0]\n", "kit.toml:6:"},
        {"unknown sound", good + "sound = { instrument = \"kazoo\" }\n", "kit.toml:6:"},
        {"unknown sound parameter", good + "sound = { frequence_hz = 3 }\n", "kit.toml:6:"},
    };
    const Folder folder;
    for (const Case& c : cases) {
        write(folder / "kit.toml", c.text);
        const Ended ended =
            run({"play", bundled("traces/flourish.csv").string(), "--kit", (folder / "kit.toml").string(),
                 "--out", (folder / "out").string(), "--no-frames"});
        expect_refused(ended, c.what, c.place);
        expect_nothing_finished(folder / "out");
    }
}

TEST(BadInput, AMalformedMeshIsRefused) {
    const Folder folder;
    for (const std::string& text :
         {std::string(), std::string("not a mesh"), std::string("v nan 0 0\nv 0 1 0\nv 1 0 0\nf 1 2 3\n"),
          std::string("v 1e999 0 0\n"), std::string("v 1 one 0\n")}) {
        write(folder / "broken.obj", text);
        write(folder / "kit.toml",
              "[[instrument]]\nname = \"a\"\nkind = \"drum\"\nsize = [0.3, 0.1, 0.3]\nposition = [0, 0.7, "
              "0]\nmesh = \"broken.obj\"\n");
        const Ended ended = run({"play", bundled("traces/flourish.csv").string(), "--kit",
                                 (folder / "kit.toml").string(), "--out", (folder / "out").string()});
        expect_refused(ended, "mesh", "broken.obj");
        expect_nothing_finished(folder / "out");
    }
}

/// Files that ask for much: each is refused within 30 s of processor time (sanitizers are ten times slower; it takes less
/// than one without), and nothing is written.
TEST(BadInput, GreedyFilesOfKitsAreRefusedInTime) {
    const Folder folder;
    const std::string start =
        "[[instrument]]\nname = \"a\"\nkind = \"drum\"\nsize = [0.3, 0.1, 0.3]\nposition = [0, 0.7, 0]\n";
    std::string regions, triangles = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nusemtl a\n";
    for (int i = 0; i < 5000; ++i) regions += "<region> sample=a.wav key=38\n";
    for (int i = 0; i < 500001; ++i) triangles += "f 1//1 2//1 3//1\n";
    std::string header =
        "RIFF\xff\xff\xff\x7fWAVE"
        "fmt \x10";
    header += std::string(
        "\0\0\0\1\0\1\0\x80\xbb\0\0\0\x77\1\0\2\0\x10\0"
        "data\xf0\xff\xff\x7f",
        27);
    const std::vector<Case> cases = {
        {"bomb.sfz", regions, "bomb.sfz"},
        {"bomb.obj", triangles, "bomb.obj"},
        {"bomb.wav", header + std::string(64, '\0'), "bomb.wav"},
        {"bomb.sf2", "RIFF\xff\xff\xff\x7fsfbkLIST\xff\xff\xff\x7fsdta", "bomb.sf2"},
        {"bomb.xml", std::string(100000, '<'), "bomb.xml"},
        {"bomb.orc", "instr a\nwhile 1 > 0 do\nod\nendin\n", "bomb.orc"}};
    write(folder / "a.wav", read(bundled("kits/defaults.toml")));
    for (const auto& [name, text, place] : cases) {
        write(folder / name, text);
        const std::string key = name.ends_with(".obj") ? "mesh = \"" + name + "\"\n"
                                : name.ends_with(".orc")
                                    ? "sound = { orchestra = \"" + name + "\", instrument = \"a\" }\n"
                                    : "sound = { samples = \"" + name + "\" }\n";
        write(folder / "kit.toml", start + key);
        for (const std::string& command :
             {"kit check " + (folder / "kit.toml").string(),
              "kit copy " + (folder / "kit.toml").string() + " --out " + (folder / "copy.toml").string()})
            expect_refused(
                run_command({"bash", "-c", "ulimit -t 30; exec " MUSICWORLD_PROGRAM " " + command}), name,
                place);
        EXPECT_FALSE(fs::exists(folder / "copy.toml"));
        EXPECT_FALSE(fs::exists(folder / "copy-files"));
    }
}

TEST(BadInput, ArgumentsAndPlacesThatCannotBeAreRefused) {
    const Folder folder;
    const std::string trace = bundled("traces/flourish.csv").string(), out = (folder / "out").string(),
                      hand = (folder / "hand.csv").string();
    write(folder / "file", "x");
    write(hand, "t,pedal,value\n1,crash,1\n");
    fs::create_directory(folder / "dir");
    const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
        {{"play", (folder / "none.csv").string(), "--out", out}, "none.csv"},
        {{"play", (folder / "dir").string(), "--out", out}, "dir"},
        {{"play", trace, "--out", out, "--kit", (folder / "none.toml").string()}, "none.toml"},
        {{"play", trace, "--out", out, "--kit", (folder / "dir").string()}, "dir"},
        {{"play", trace, "--out", (folder / "file").string()}, "file"},
        {{"play", trace, "--out", (folder / "file").string() + "/below"}, "file"},
        {{"play", trace, "--out", "/proc/nowhere"}, "/proc/nowhere"},
        {{"play", trace, "--out", out, "--fps", "fast"}, "--fps"},
        {{"play", trace, "--out", out, "--fps", "0"}, "--fps"},
        {{"play", trace, "--out", out, "--size", "640"}, "--size"},
        {{"play", trace, "--out", out, "--size", "99999x1"}, "--size"},
        {{"play", trace, "--out", out, "--sound-lead", "1/0"}, "--sound-lead"},
        {{"play", trace, "--out", out, "--sound-lead", "nan"}, "--sound-lead"},
        {{"play", trace, "--out", out, "--release-margin", "-1"}, "--release-margin"},
        {{"play", trace, "--out", out, "--predictor", "oracle"}, "oracle"},
        {{"play", trace, "--out", out, "--predictor", "ca:q=much"}, "much"},
        {{"play", trace, "--out", out, "--predictor", "auto:model="}, "model="},
        {{"play", trace, "--out", out, "--no-frames", "--bus-stems"}, "--bus-stems"},
        {{"play", trace, "--out", out, "--workers", "-1"}, "workers"},
        {{"play", trace, "--out", out, "--workers", "many"}, "workers"},
        {{"play", trace, "--out", out, "--tip", "1,2"}, "--tip"},
        {{"play", trace, "--out", out, "--frobnicate"}, "frobnicate"},
        {{"play", trace, "--out", out, "--solo", "999999", "--no-frames"}, "--solo"},
        {{"play", trace, "--out", out, "--solo", "1000000000", "--pedals", hand, "--no-frames"}, "no choke"},
        {{"train", trace, trace, "--steps", "1", "--out", out}, "samples of"},
        {{"kit", "draw", "drums", "--out", (folder / "kit.jpg").string()}, "kit.jpg"},
        {{"dance"}, "dance"},
        {{}, "usage"},
    };
    for (const auto& [arguments, place] : cases) {
        expect_refused(run(arguments), arguments.empty() ? "nothing" : arguments.back(), place);
        expect_nothing_finished(folder / "out");
    }
}

TEST(BadInput, WhatIsReadIsNotReplaced) {
    const Folder folder;
    const fs::path take = folder / "take.csv";
    fs::copy_file(bundled("traces/roll.csv"), take);
    fs::create_hard_link(take, folder / "other.csv");
    const std::string before = read(take);
    const std::vector<std::vector<std::string>> commands = {
        {"trace", "convert", take, "--out", folder / "other.csv"},
        {"predict", take, "--predictor", "hold", "--lead", "1/30", "--out", take},
        {"train", take, "--out", take},
        {"record", "--source", "trace:" + take.string(), "--out", take},
        {"play", take, "--no-frames", "--save-model", folder / "other.csv", "--out", folder / "out"}};
    for (const std::vector<std::string>& command : commands) {
        expect_refused(run(command), command.front(), "which is read, too");
        EXPECT_EQ(read(take), before) << command.front();
    }
}

TEST(BadInput, AFullDiskFailsWithOneLineAndLeavesNothingThatLooksFinished) {
    const Folder folder;
    fs::create_directory(folder / "small");
    if (mount("none", (folder / "small").c_str(), "tmpfs", 0, "size=300k") != 0)
        GTEST_SKIP() << "needs the right to mount";
    const Ended ended = run({"play", bundled("traces/flourish.csv").string(), "--out",
                             (folder / "small/out").string(), "--size", "160x120"});
    expect_refused(ended, "disk full", "small/out", 1);
    expect_nothing_finished(folder / "small/out");
    umount((folder / "small").c_str());
}

}  // namespace
}  // namespace end_to_end
