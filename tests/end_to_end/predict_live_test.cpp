// `musicworld predict` of live sticks, as another program uses it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "app/free_port.h"
#include "program.h"

namespace end_to_end {
namespace {

namespace fs = std::filesystem;

TEST(PredictLive, OfStandardInputItWritesWhatItWritesOfTheFile) {
    const Folder folder;
    const std::string trace = bundled("traces/roll.csv").string();
    const Ended file = run({"predict", trace, "--predictor", "auto", "--lead", "1/15"});
    ASSERT_EQ(file.status, 0) << file.err;
    const Ended stream = run_command(
        {"sh", "-c", "\"$0\" predict - --predictor auto --lead 1/15 < \"$1\"", MUSICWORLD_PROGRAM, trace});
    ASSERT_EQ(stream.status, 0) << stream.err;
    EXPECT_EQ(stream.out, file.out);
    EXPECT_EQ(stream.err, "");
}

/// 200 rows at 100 Hz, the eleventh with a time far away. The first row has no answer; at the worst the stray one
/// is answered and the two after it are left out.
TEST(PredictLive, AStrayTimeCostsNoMoreThanThreeAnswersAndIsTold) {
    const Folder folder;
    for (const double stray_s : {5e7, -5e7}) {
        std::string rows;
        std::istringstream head(read(bundled("traces/roll.csv")));
        for (std::string line; std::getline(head, line) && (line.starts_with('#') || line.starts_with("t,"));)
            rows += line + "\n";
        for (int i = 0; i < 200; ++i)
            rows += std::to_string(i == 10 ? stray_s : 0.01 * i) + ",left,0.1,1,0.2,1,0,0,0\n";
        write(folder / "rows", rows);
        const Ended ended = run_command({"sh", "-c", "\"$0\" predict - --predictor ca --lead 0.01 < \"$1\"",
                                         MUSICWORLD_PROGRAM, folder / "rows"});
        ASSERT_EQ(ended.status, 0) << ended.err;
        EXPECT_GE(std::count(ended.out.begin(), ended.out.end(), '\n'), 1 + 199 - 3) << stray_s;
        EXPECT_NE(ended.err.find(stray_s < 0 ? "1 sample left out" : "2 samples left out"), std::string::npos)
            << ended.err;
    }
}

/// Where the client's stick is: 0.2 m up and down.
double height(double t) {
    return 1 + 0.2 * std::sin(8 * t);
}

TEST(PredictLive, TheClientOfTheDocumentationGetsAnswersToItsPoses) {
    if (std::system("python3 -c '' 2>/dev/null") != 0) GTEST_SKIP() << "needs python3";
    const Folder folder;
    const std::string to = std::to_string(app::free_udp_port()), back = std::to_string(app::free_udp_port());
    Started server({"predict", "--source", "osc:" + to, "--predictor", "ca", "--lead", "1/30,1/15", "--kit",
                    "drums", "--tip", "0,0,0", "--seconds", "60", "--send", "osc:" + back},
                   folder / "");
    const Ended client =
        run_command({"python3", bundled("predictors/live_client.py").string(), to, back, "150"});
    kill(server.pid(), SIGINT);
    const Ended served = server.wait();
    EXPECT_EQ(served.status, 0) << served.err;
    EXPECT_NE(served.err.find(" us at p99"), std::string::npos) << served.err;
    ASSERT_EQ(client.status, 0) << client.err;

    std::istringstream lines(client.out);
    int poses = 0, regions = 0;
    double worst = 0, held = 0;
    for (std::string line; std::getline(lines, line);) {
        std::istringstream words(line);
        std::string address;
        double t = 0, lead = 0, x = 0, y = 0, z = 0, w = 0;
        words >> address >> t >> lead >> x >> y >> z >> w;
        if (line.starts_with("the 50 % region reaches ")) {
            ++regions;
            continue;
        }
        if (address != "/musicworld/predicted/left") {
            EXPECT_EQ(address, "/musicworld/next_strike/left");
            continue;
        }
        ++poses;
        EXPECT_TRUE(std::abs(lead - 1 / 30.0) < 1e-6 || std::abs(lead - 1 / 15.0) < 1e-6) << line;
        EXPECT_EQ(std::hypot(x, z, w - 1), 0);
        std::vector<double> more;
        for (double number = 0; words >> number;) more.push_back(number);
        EXPECT_EQ(more.size(), 3 + 6 + 2U)
            << "the rest of the quaternion, the covariance, two radii: " << line;
        if (t < 0.5) continue;
        worst = std::max(worst, std::abs(y - height(t + lead)));
        held = std::max(held, std::abs(height(t) - height(t + lead)));
    }
    // All answers but those of the first poses, which may have come before the server was there.
    EXPECT_GT(poses, 200);
    EXPECT_EQ(regions, poses);
    // Constant acceleration, 8 rad/s: the third derivative 102 m/s^3 moves it by 5 mm in 1/15 s; it is held 107 mm off.
    EXPECT_LT(worst, 0.015);
    EXPECT_GT(held, 0.1);
}

TEST(PredictLive, RefusesWhatCannotBe) {
    const auto refused = [](std::vector<std::string> arguments, const std::string& found) {
        arguments.insert(arguments.begin(), {"predict", "--predictor", "auto", "--lead", "1/15"});
        expect_refused(run(arguments), found);
    };
    refused({}, "no TRACE");
    refused({"roll", "--source", "stdin", "--send", "osc:9"}, "TRACE with --source");
    refused({"--source", "stdin"}, "--source without --send");
    refused({"roll", "--send", "osc:9"}, "--send without --source");
    refused({"--source", "stdin", "--send", "osc:0"}, "--send osc:0");
    refused({"--source", "stdin", "--send", "zmq:nowhere"}, "zmq:nowhere");
    refused({"--source", "stdin", "--send", "osc:9", "--rate", "60"}, "--rate with --source");
    refused({"roll", "--kit", "drums"}, "--kit without --source");
    refused({"-", "--noise", "1"}, "--noise with -");
    expect_refused(run({"predict", "roll", "--predictor", "auto", "--lead", "1/15,1/30"}), "2 leads");
}

}  // namespace
}  // namespace end_to_end
