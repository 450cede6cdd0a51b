// `play --realtime` and `latency` as a user runs them, also when processes are killed on the way.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "program.h"

namespace end_to_end {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

std::vector<std::string> in_time(const std::string& command, const fs::path& out,
                                 std::vector<std::string> more) {
    std::vector<std::string> all = {command, bundled("traces/roll.csv"), "--out", out, "--size", "64x48"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
}

/// The processes of `musicworld sensor` that a process has started.
std::vector<int> sensors_below(int parent) {
    std::vector<int> found;
    std::error_code error;
    for (const fs::directory_entry& entry : fs::directory_iterator("/proc", error)) {
        const std::string name = entry.path().filename();
        if (!std::isdigit(static_cast<unsigned char>(name[0]))) continue;
        std::ifstream stat(entry.path() / "stat"), line(entry.path() / "cmdline");
        std::string text, arguments{std::istreambuf_iterator<char>(line), {}};
        std::getline(stat, text);
        std::istringstream fields(text.substr(std::min(text.size(), text.rfind(')') + 2)));
        char state = 0;
        int of = 0;
        fields >> state >> of;
        if (of == parent && state != 'Z' && arguments.find(std::string("\0sensor\0", 8)) != std::string::npos)
            found.push_back(std::stoi(name));
    }
    return found;
}

/// Waits up to 20 s.
template <class Condition>
bool happens(Condition condition) {
    for (int i = 0; i < 2000 && !condition(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return condition();
}

bool alive(int pid) {
    return kill(pid, 0) == 0;
}

TEST(Latency, SaysWhatScriptsRelyOn) {
    const Folder folder;
    const Ended ended = run(in_time("latency", folder / "played", {"--seconds", "2", "--json"}));
    ASSERT_EQ(ended.status, 0) << ended.err;
#ifdef __SANITIZE_ADDRESS__
    // Csound writes a row of dashes to standard output when it runs under the sanitizer.
    const Json said = Json::parse(ended.out.substr(ended.out.find('{')));
#else
    const Json said = Json::parse(ended.out);
#endif
    EXPECT_EQ(said, Json::parse(read(folder / "played/latency.json")));
    for (const Json& stage : said.at("stages")) {
        EXPECT_FALSE(stage.at("name").get<std::string>().empty());
        EXPECT_LE(stage.at("p50_ms"), stage.at("p95_ms"));
        EXPECT_LE(stage.at("p95_ms"), stage.at("p99_ms"));
        EXPECT_LE(stage.at("p99_ms"), stage.at("max_ms"));
    }
    EXPECT_GE(said.at("stages").size(), 12U);
    EXPECT_LE(said.at("frames").at("missed"), said.at("frames").at("total"));
    EXPECT_GE(said.at("notes").at("total"), 5);
    for (const char* key : {"p5", "median", "p95", "min", "max"})
        EXPECT_TRUE(said.at("sound_minus_picture_ms").contains(key)) << key;
    EXPECT_GT(said.at("lead_needed_ms").at("sound"), 4.0);  // the output lead is part of it
    for (const char* file :
         {"latency.html", "samples.csv", "frames.csv", "notes.csv", "blocks.csv", "leads.csv"})
        EXPECT_TRUE(fs::exists(folder / "played" / file)) << file;
    const Ended compared = run({"latency", "--compare", folder / "played", folder / "played"});
    EXPECT_EQ(compared.status, 0) << compared.err;
    EXPECT_NE(compared.out.find("sample to notes"), std::string::npos) << compared.out;
}

/// Whether it says that it had no time to begin. Whatever else fails is no matter of time.
bool began_late(const Ended& ended) {
    return ended.status == 1 && (ended.err.find("interrupted before anything was played") != ended.err.npos ||
                                 ended.err.find("expected a machine less busy") != ended.err.npos);
}

/// Tries with more and more time, for machines that take long to start a process: true at the first success. The last one says
/// what went wrong.
template <class Attempt>
bool with_time_enough(Attempt attempt) {
    return attempt(1) || attempt(4) || attempt(16);
}

TEST(Realtime, AKilledSensorIsStartedAgainAndThePlayGoesOn) {
    std::string found;
    const auto attempt = [&](int times) {
        const Folder folder;
        Started started(in_time("play", folder / "played",
                                {"--realtime", "--seconds", std::to_string(6 * times), "--no-frames"}),
                        folder / "");
        (void)happens([&] { return sensors_below(started.pid()).size() == 2; });
        std::this_thread::sleep_for(std::chrono::milliseconds(2500 * times));
        const std::vector<int> sensors = sensors_below(started.pid());
        if (!sensors.empty()) kill(sensors[0], SIGKILL);
        const Ended ended = started.wait();
        found = ended.err;
        if (began_late(ended)) return false;
        EXPECT_EQ(ended.status, 0) << ended.err;
        const Json summary = Json::parse(read(folder / "played/summary.json"));
        EXPECT_EQ(summary.at("realtime").at("against_offline").at("unexplained"), 0)
            << read(folder / "played/departures.csv");
        found += summary.dump();
        return sensors.size() == 2 &&
               ended.err.find("killed by signal 9; started again") != std::string::npos &&
               summary.at("strikes").at("released") > 20;
    };
    EXPECT_TRUE(with_time_enough(attempt)) << found;
}

TEST(Realtime, APredictorOfOnesOwnStrikesAsOfflineButForDelays) {
    if (!has_python()) GTEST_SKIP() << "needs python3";
    const Folder folder;
    const Ended ended =
        run(in_time("play", folder / "played",
                    {"--realtime", "--seconds", "2.5", "--no-frames", "--predictor", python_example()}));
    ASSERT_EQ(ended.status, 0) << ended.err;
    const Json summary = Json::parse(read(folder / "played/summary.json"));
    EXPECT_GT(summary.at("strikes").at("released"), 0);
    EXPECT_EQ(summary.at("realtime").at("against_offline").at("unexplained"), 0)
        << read(folder / "played/departures.csv");
}

TEST(Realtime, AFaultyPredictorOfOnesOwnEndsItWithOneLineAndStatus1) {
    const Folder folder;
    for (const auto& [predictor, message] :
         {std::pair<std::string, std::string>{"exec:cat", "exec:cat, stick left, first line: error: found"},
          {"exec:read h; echo position; read l", "answer 1: error: found the child ended with status 0"}}) {
        const Ended ended =
            run(in_time("play", folder / "played",
                        {"--realtime", "--seconds", "60", "--no-frames", "--sound-predictor", predictor}));
        EXPECT_EQ(ended.status, 1) << predictor << ended.err;
        EXPECT_NE(ended.err.find(message), std::string::npos) << ended.err;
    }
}

TEST(Realtime, AChildThatPredictsEndsWithTheProgramHoweverThatEnds) {
    for (const int signal : {SIGTERM, SIGINT, SIGKILL}) {
        const Folder folder;
        // Each shell and a process that it has started; neither reads its input's end.
        const std::string child =
            "exec:read head; set -- $head; shift 3; n=$#; echo position; sleep 1000 & echo $! $$ >> '" +
            (folder / "pids").string() +
            "'; while read t x y z rest; do a=; i=0; while [ $i -lt $n ]; do a=\"$a $x $y $z\"; i=$((i+1)); "
            "done; echo $a; done; sleep 1000";
        Started started(in_time("play", folder / "played",
                                {"--realtime", "--seconds", "60", "--no-frames", "--sound-predictor", child}),
                        folder / "");
        const auto pids = [&] {
            std::vector<int> all;
            std::istringstream text(read(folder / "pids"));
            for (int pid = 0; text >> pid;) all.push_back(pid);
            return all;
        };
        ASSERT_TRUE(happens([&] { return pids().size() == 4; }));  // two sticks
        kill(started.pid(), signal);
        (void)started.wait();
        for (const int pid : pids()) EXPECT_TRUE(happens([&] { return !alive(pid); })) << "signal " << signal;
    }
}

TEST(Realtime, InterruptedItFinishesWhatItHas) {
    std::string found;
    const auto attempt = [&](int times) {
        const Folder folder;
        Started started(in_time("play", folder / "played", {"--realtime", "--seconds", "600", "--no-frames"}),
                        folder / "");
        (void)happens([&] { return sensors_below(started.pid()).size() == 2; });
        std::this_thread::sleep_for(std::chrono::milliseconds(2500 * times));
        kill(started.pid(), SIGINT);
        const Ended ended = started.wait();
        found = ended.err;
        if (began_late(ended)) return false;
        EXPECT_EQ(ended.status, 0) << ended.err;
        EXPECT_LT(Json::parse(read(folder / "played/summary.json")).at("duration_s"), 500);
        int channels = 0;
        return read_wav(folder / "played/audio.wav", channels).size() > 48000U;
    };
    EXPECT_TRUE(with_time_enough(attempt)) << found;
}

TEST(Realtime, AProgramThatIsKilledLeavesNoProcessAndNoMemoryBehind) {
    const Folder folder;
    Started started(in_time("play", folder / "played", {"--realtime", "--seconds", "60", "--no-frames"}),
                    folder / "");
    ASSERT_TRUE(happens([&] { return sensors_below(started.pid()).size() == 2; }));
    const std::vector<int> sensors = sensors_below(started.pid());
    kill(started.pid(), SIGKILL);
    (void)started.wait();
    for (const int sensor : sensors) EXPECT_TRUE(happens([&] { return !alive(sensor); })) << sensor;
    EXPECT_FALSE(fs::exists(folder / "played/summary.json"));
}

TEST(Realtime, WhatCannotBeIsRefusedInOneLine) {
    const Folder folder;
    const std::vector<std::vector<std::string>> cases = {
        {"--seconds", "5"},  // without --realtime
        {"--realtime", "--lead", "long"},
        {"--realtime", "--seconds", "-1"},
        {"--realtime", "--priority", "high"},
        {"--realtime", "--disturb", "rain:1@2"},
        {"--realtime", "--output-lead", "0.010"},
        {"--realtime", "--source", "stdin"},  // with TRACE
        {"--realtime", "--sound-predictor", "exec:"},
        {"--realtime", "--solo", "1"},
    };
    for (const auto& more : cases) {
        const Ended ended = run(in_time("play", folder / "played", more));
        EXPECT_EQ(ended.status, 2) << more.back() << ended.err;
        EXPECT_EQ(std::count(ended.err.begin(), ended.err.end(), '\n'), 1) << ended.err;
        EXPECT_NE(ended.err.find("expected"), std::string::npos) << ended.err;
        EXPECT_FALSE(fs::exists(folder / "played/summary.json"));
    }
    for (const std::string source : {"osc:70000", "pigeon"})
        expect_refused(run({"play", "--realtime", "--source", source, "--out", folder / "played"}), source);
    // No JACK server runs under this name.
    const Ended jack =
        run(in_time("play", folder / "played", {"--realtime", "--output", "jack", "--no-frames"}),
            {"JACK_DEFAULT_SERVER=musicworld-none"});
    EXPECT_EQ(jack.status, 1);
    EXPECT_EQ(std::count(jack.err.begin(), jack.err.end(), '\n'), 1) << jack.err;
    const Ended alsa =
        run(in_time("play", folder / "played", {"--realtime", "--output", "alsa:no_such", "--no-frames"}));
    EXPECT_EQ(alsa.status, 1);
    EXPECT_EQ(std::count(alsa.err.begin(), alsa.err.end(), '\n'), 1) << alsa.err;
    expect_refused(run({"play", "--realtime", "--output", "speaker", "--out", folder / "played"}), "speaker");
}

}  // namespace
}  // namespace end_to_end
