// `musicworld record`, as a user runs it; replays are sped up by a hidden option, on the same path.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <thread>

#include "program.h"

namespace {

namespace fs = std::filesystem;
using namespace end_to_end;

/// The text without its line `# source: ...`.
std::string without_source(const std::string& text) {
    const std::size_t at = text.find("# source:");
    return at == std::string::npos ? text : text.substr(0, at) + text.substr(text.find('\n', at) + 1);
}

std::string source_of(const std::string& text) {
    const std::size_t at = text.find("# source:");
    return text.substr(at, text.find('\n', at) - at);
}

/// Waits up to 20 s.
template <class Condition>
bool happens(Condition condition) {
    for (int i = 0; i < 2000 && !condition(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return condition();
}

TEST(Record, OfAReplayedTraceGivesTheTraceBack) {
    const Folder folder;
    // Of the bundled one, rewritten so that its rounded quaternions are the doubles that every reader gets.
    const Ended converted =
        run({"trace", "convert", bundled("traces/roll.csv"), "--out", folder / "roll.csv"});
    ASSERT_EQ(converted.status, 0) << converted.err;
    const Ended recorded = run({"record", "--source", "trace:" + (folder / "roll.csv").string(), "--out",
                                folder / "again.csv", "--speed", "10"});
    ASSERT_EQ(recorded.status, 0) << recorded.err;
    EXPECT_EQ(without_source(read(folder / "again.csv")), without_source(read(folder / "roll.csv")));
    EXPECT_TRUE(
        source_of(read(folder / "again.csv"))
            .starts_with("# source: recorded; clock of the times: the trace's own, replayed; synthetic: "));
    EXPECT_NE(recorded.out.find("again.csv: left: 1201 samples in 10.000 s, 120.00 per second, 0 gaps\n"),
              std::string::npos)
        << recorded.out;
    EXPECT_FALSE(fs::exists(folder / "again.csv.partial"));
}

TEST(Record, KeepsTimesAndDropOutsAndSaysThem) {
    const Folder folder;
    std::string rows = "t,stick,px,py,pz\n";
    for (int i = 0; i < 200; ++i)
        if (i < 60 || i >= 90) rows += std::to_string(0.01 * i) + ",left,0,1,0\n";
    write(folder / "gap.csv", rows);
    const Ended recorded = run({"record", "--source", "trace:" + (folder / "gap.csv").string(), "--out",
                                folder / "out.csv", "--speed", "10"});
    ASSERT_EQ(recorded.status, 0) << recorded.err;
    EXPECT_NE(recorded.out.find("left: 170 samples in 1.990 s, 84.92 per second, 1 gap, the longest 0.310 s"),
              std::string::npos)
        << recorded.out;
    EXPECT_EQ(read_csv(folder / "gap.csv").size(), 170u);
    const Ended checked = run({"trace", "check", folder / "out.csv"});
    EXPECT_EQ(checked.status, 0) << checked.err;
    EXPECT_NE(read(folder / "out.csv").find("\n0.59,left,0,1,0\n0.9,left,0,1,0\n"), std::string::npos);
}

TEST(Record, EndsAtItsTimeOrASignalWithAWholeTrace) {
    const Folder folder;
    const Ended timed = run({"record", "--source", "trace:flourish", "--out", folder / "a.csv", "--seconds",
                             "0.5", "--sticks", "right"});
    ASSERT_EQ(timed.status, 0) << timed.err;
    EXPECT_EQ(run({"trace", "check", folder / "a.csv"}).status, 0);
    EXPECT_EQ(read(folder / "a.csv").find("left"), std::string::npos);
    const auto [first, last] = time_span(read(folder / "a.csv"));
    EXPECT_EQ(first, 0);
    EXPECT_LT(last, 5);  // of 10 s; when the first sample is late, more fit into half a second

    Started started({"record", "--source", "trace:flourish", "--out", folder / "b.csv"}, folder / "");
    ASSERT_TRUE(happens([&] {
        return fs::exists(folder / "b.csv.partial") && fs::file_size(folder / "b.csv.partial") > 1000;
    }));
    kill(started.pid(), SIGINT);
    EXPECT_EQ(started.wait().status, 0);
    EXPECT_EQ(run({"trace", "check", folder / "b.csv"}).status, 0);
    EXPECT_FALSE(fs::exists(folder / "b.csv.partial"));
}

TEST(Record, AKilledRecordingIsATraceUpToItsLastLine) {
    const Folder folder;
    Started started({"record", "--source", "trace:flourish", "--out", folder / "b.csv"}, folder / "");
    ASSERT_TRUE(happens([&] {
        return fs::exists(folder / "b.csv.partial") && fs::file_size(folder / "b.csv.partial") > 20000;
    }));
    kill(started.pid(), SIGKILL);
    (void)started.wait();
    EXPECT_FALSE(fs::exists(folder / "b.csv"));
    std::string kept = read(folder / "b.csv.partial");
    kept.resize(kept.rfind('\n') + 1);
    write(folder / "kept.csv", kept);
    const Ended checked = run({"trace", "check", folder / "kept.csv"});
    EXPECT_EQ(checked.status, 0) << checked.err;
}

TEST(Record, AFullDiskIsOneLineAndKeepsWhatWasWritten) {
    const Folder folder;
    // Files may grow to 20 kB; the program takes SIGXFSZ for an error, as it does a full disk (EFBIG,
    // ENOSPC).
    rlimit old{};
    getrlimit(RLIMIT_FSIZE, &old);
    const rlimit small{20000, old.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
    const Ended recorded =
        run({"record", "--source", "trace:flourish", "--out", folder / "c.csv", "--speed", "5"});
    setrlimit(RLIMIT_FSIZE, &old);
    EXPECT_EQ(recorded.status, 1);
    EXPECT_EQ(recorded.err,
              (folder / "c.csv.partial").string() +
                  ": error: found no way to write on (File too large), expected room; what was recorded "
                  "until then is kept there\n");
    EXPECT_FALSE(fs::exists(folder / "c.csv"));
    EXPECT_EQ(fs::file_size(folder / "c.csv.partial"), 20000u);
}

TEST(Record, BadInputIsOneLine) {
    const Folder folder;
    const auto refused = [&](const std::vector<std::string>& more, const std::string& message) {
        std::vector<std::string> arguments = {"record", "--out", folder / "out.csv"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Ended ended = run(arguments);
        EXPECT_EQ(ended.status, 2);
        EXPECT_NE(ended.err.find(message), std::string::npos) << ended.err;
        EXPECT_EQ(std::count(ended.err.begin(), ended.err.end(), '\n'), 1) << ended.err;
        EXPECT_FALSE(fs::exists(folder / "out.csv.partial"));
    };
    refused({"--source", "tape:x"}, "found source \"tape:x\", expected trace:FILE, stdin");
    refused({"--source", "osc:lots"}, "found source \"osc:lots\", expected a UDP port such as osc:9000");
    refused({"--source", "zmq:nowhere"}, "found source \"zmq:nowhere\", expected an endpoint such as");
    refused({"--source", "trace:" + (folder / "none.csv").string()}, "none.csv: error: found no such file");
    refused({"--source", "trace:flourish", "--sticks", "foot"},
            "found no stick \"foot\", expected one of left, right");
    refused({"--source", "trace:flourish", "--seconds", "-1"}, "found --seconds -1");
    const Ended no_folder = run({"record", "--source", "trace:flourish", "--out", folder / "no/out.csv"});
    EXPECT_EQ(no_folder.status, 2);
    EXPECT_NE(no_folder.err.find("found no such folder"), std::string::npos) << no_folder.err;
}

}  // namespace
