// musicworld bench is musicworld_bench, a program beside it.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "program.h"

namespace end_to_end {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

TEST(Bench, BecomesTheProgramBesideItWithTheSameArguments) {
    const Folder folder;
    const Ended ended =
        run({"bench", "--json", "sim", "--bodies", "4", "--rounds", "1", "--out", folder / "out"});
    ASSERT_EQ(ended.status, 0) << ended.err;
    const json document = json::parse(ended.out);
    EXPECT_TRUE(document["machine"].contains("processor"));
    ASSERT_FALSE(document["results"].empty());
    for (const json& result : document["results"])
        for (const char* key : {"name", "value", "unit", "peer", "peer_version", "ratio"})
            EXPECT_TRUE(result.contains(key)) << result;
    EXPECT_EQ(read(folder / "out" / "bench.json"), ended.out);
    expect_refused(run({"bench", "nothing"}), "nothing");
    expect_refused(run({"bench", "sim", "--bodies", "none"}), "--bodies");
    EXPECT_NE(run({"bench", "--help"}).out.find("--rounds"), std::string::npos);
}

TEST(Bench, HardScenesWriteTheirFiguresTablePageAndPlot) {
    const Folder folder;
    const Ended ended =
        run({"bench", "hard", "--scenes", "ghost", "--halvings", "0", "--json", "--out", folder / "out"});
    ASSERT_EQ(ended.status, 0) << ended.err;
    EXPECT_EQ(json::parse(ended.out)["results"][0]["name"], "hard_ghost");
    EXPECT_EQ(read(folder / "out" / "bench.json"), ended.out);
    EXPECT_NE(read(folder / "out" / "hard.csv").find("scene,engine,version,settings,step_s"),
              std::string::npos);
    EXPECT_NE(read(folder / "out" / "hard.svg").find("ghost"), std::string::npos);
    EXPECT_NE(read(folder / "out" / "hard.html").find("<table"), std::string::npos);
    expect_refused(run({"bench", "hard", "--scenes", "nothing"}), "--scenes");
}

TEST(Bench, WithoutItSaysHowToBuildIt) {
    const Folder folder;
    fs::copy_file(MUSICWORLD_PROGRAM, folder / "musicworld");
    const Ended ended = run_command({folder / "musicworld", "bench", "sim"});
    EXPECT_EQ(ended.status, 1);
    EXPECT_EQ(ended.err, "error: cannot start " + (folder / "musicworld_bench").string() +
                             ": No such file or directory; `./run bench`, or cmake --build BUILD --target "
                             "musicworld_bench, builds it\n");
}

}  // namespace
}  // namespace end_to_end
