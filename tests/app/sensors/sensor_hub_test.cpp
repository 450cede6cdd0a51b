// Real sensor processes that replay traces. Waits are bounded by seconds, so that a loaded machine passes; no
// delay is asserted.
#include "sensors/sensor_hub.h"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>

#include "files/assets.h"
#include "files/bad_input.h"
#include "process/clock.h"
#include "sensors/watched_hub.h"
#include "sticks/stick.h"
#include "temporary_folder.h"

namespace {

namespace fs = std::filesystem;
using namespace app_test;

std::string cut_of(const std::string& trace, double from_s, double until_s) {
    tracking::Trace cut = tracking::read_trace(app::find_trace(trace));
    for (tracking::StickTrace& stick : cut.sticks)
        std::erase_if(stick.samples,
                      [&](const tracking::PoseSample& s) { return s.t_s < from_s || s.t_s >= until_s; });
    return tracking::format_trace(cut);
}

/// How many sticks' shared memory this process has mapped.
int mapped_memories() {
    std::ifstream maps("/proc/self/maps");
    int count = 0;
    for (std::string line; std::getline(maps, line);)
        count += line.find("/memfd:musicworld") != std::string::npos;
    return count;
}

/// Bit by bit.
void expect_same(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    EXPECT_EQ(std::memcmp(a.data(), b.data(), sizeof a), 0) << a.transpose() << " against " << b.transpose();
}
void expect_same(const tracking::PosePrediction& a, const tracking::PosePrediction& b) {
    expect_same(a.position, b.position);
    expect_same(a.velocity, b.velocity);
    EXPECT_EQ(a.orientation.coeffs(), b.orientation.coeffs());
}

TEST(SensorHub, StatesEqualAnOfflineRunToTheBit) {
    const TemporaryFolder folder;
    const fs::path file = folder.write("short.csv", cut_of("flourish", 0, 1.0));
    const tracking::Trace trace = tracking::read_trace(file);
    app::SensorOptions options = options_for("trace:" + file.string());
    options.period_s = 1.5;
    SensorHub hub(options);
    Watched seen;
    const auto laps = [&](std::size_t stick) {
        return seen.states[stick].empty() ? 0 : seen.states[stick].back().lap;
    };
    watch_until(hub, 2, seen, [&] { return laps(0) >= 2 && laps(1) >= 2; });
    for (std::size_t stick = 0; stick < 2; ++stick) {
        // Each state that was seen, against filters of this process that were given the same samples.
        std::optional<app::StickFilters> filters;
        tracking::StickState own;
        std::uint64_t lap = 99, count = 0;
        std::size_t next = 0, compared = 0;
        for (const tracking::StickState& state : seen.states[stick]) {
            const auto& samples = trace.sticks[stick].samples;
            if (state.lap != lap) {
                filters.emplace(options.predictors, "-");
                lap = state.lap;
                next = 0;
            }
            while (next < samples.size() && samples[next].t_s <= state.t_s)
                (void)filters->correct(samples[next++], own);
            count = state.lap * samples.size() + next;
            ASSERT_EQ(state.t_s, own.t_s);
            EXPECT_EQ(state.samples, count);  // none was refused, none left out
            EXPECT_EQ(state.starts, state.lap + 1);
            for (const double lead : {0.0, 0.05}) {
                expect_same(state.sound.after(lead), own.sound.after(lead));
                expect_same(state.picture.after(lead), own.picture.after(lead));
                expect_same(state.confirming.after(lead), own.confirming.after(lead));
            }
            EXPECT_EQ(state.picture_t_s, own.picture_t_s);
            EXPECT_EQ(state.confirming_t_s, own.confirming_t_s);
            EXPECT_EQ(state.due_ns,
                      options.epoch_ns +
                          std::llround((static_cast<double>(lap) * 1.5 + state.t_s - trace.t0_s()) * 1e9));
            EXPECT_LE(state.due_ns, state.read_ns);
            EXPECT_LE(state.read_ns, state.filtered_ns);
            ++compared;
        }
        EXPECT_GT(compared, 100u);
    }
    EXPECT_EQ(seen.messages_but_of_silence(), "");
    // The pauses between the laps are no silences: there were two for each stick, from 1 to 1.5 s in each
    // lap. One may be told of where the machine is held up just then.
    const auto in_pauses = std::count_if(seen.events.begin(), seen.events.end(), [](const SensorEvent& e) {
        return e.kind == Kind::silent && std::fmod(e.at_s, 1.5) > 1;
    });
    EXPECT_LE(in_pauses, 1) << seen.all_messages();
    for (const app::ClockReport& clock : hub.clocks()) EXPECT_EQ(clock.clock, app::SampleClock::replayed);
}

TEST(SensorHub, EndsWithItsSourceAndLeavesNothing) {
    const TemporaryFolder folder;
    const fs::path file = folder.write("short.csv", cut_of("roll", 0, 0.5));
    {
        SensorHub hub(options_for("trace:" + file.string()));
        EXPECT_EQ(mapped_memories(), 2);
        EXPECT_EQ(children().size(), 2u);
        Watched seen;
        watch_until(hub, 2, seen, [&] { return hub.ended() && seen.count(Kind::ended) == 2; });
        const std::string left = "sensor left: the source has ended after 60 samples\n",
                          right = "sensor right: the source has ended after 60 samples\n",
                          messages = seen.messages_but_of_silence();
        EXPECT_TRUE(messages == left + right || messages == right + left) << messages;
        EXPECT_EQ(hub.newest(0)->samples, 60u);
        EXPECT_EQ(hub.newest(1)->samples, 60u);
        EXPECT_EQ(hub.restarts(), 0);
    }
    EXPECT_EQ(children(), std::vector<int>{});
}

TEST(SensorHub, KilledSensorIsStartedAgainAndGoesOnAtTheCurrentTime) {
    SensorHub hub(options_for("trace:flourish"));
    Watched seen;
    watch_until(hub, 2, seen, [&] { return !seen.states[0].empty() && seen.states[0].back().samples > 30; });
    const int victim = children().front();
    const std::uint64_t before = hub.newest(0)->samples;
    ASSERT_EQ(kill(victim, SIGKILL), 0);
    const std::int64_t killed_ns = app::monotonic_ns();
    watch_until(hub, 2, seen, [&] { return seen.states[0].back().samples > before + 30; });
    ASSERT_EQ(seen.count(Kind::restarted), 1u) << seen.all_messages();
    const auto event = std::find_if(seen.events.begin(), seen.events.end(),
                                    [](const SensorEvent& e) { return e.kind == Kind::restarted; });
    EXPECT_EQ(
        event->message,
        "sensor left: its process was killed by signal 9; started again (1 of at most 5 times in 10 s)");
    EXPECT_EQ(event->sticks, std::vector<std::string>{"left"});
    EXPECT_EQ(hub.restarts(), 1);
    const tracking::Trace trace = tracking::read_trace(app::find_trace("flourish"));
    const auto due_until = [&](double t_s) {
        const auto& rows = trace.sticks[0].samples;
        return static_cast<std::uint64_t>(
            std::count_if(rows.begin(), rows.end(), [&](const auto& row) { return row.t_s <= t_s; }));
    };
    std::uint64_t samples = 0, starts = 0;
    for (const tracking::StickState& state : seen.states[0]) {
        EXPECT_GT(state.samples, samples);
        samples = state.samples;
        // Those that were due in the gap are counted, too.
        EXPECT_EQ(state.samples + state.refused, due_until(state.t_s));
        if (state.starts != starts && starts != 0) {
            EXPECT_GE(state.due_ns, killed_ns - 100'000'000);
        }
        starts = state.starts;
    }
    EXPECT_EQ(starts, 2u);
}

TEST(SensorHub, ASensorThatIsInterruptedIsStartedAgainAndItsSourceHasNotEnded) {
    SensorHub hub(options_for("trace:flourish"));
    Watched seen;
    watch_until(hub, 2, seen, [&] { return !seen.states[0].empty() && !seen.states[1].empty(); });
    for (const int ignored : {SIGINT, SIGHUP}) {  // a terminal sends them to the hub, too
        for (const int child : children()) ASSERT_EQ(kill(child, ignored), 0);
        watch_until(hub, 2, seen,
                    [&, samples = hub.newest(1)->samples] { return hub.newest(1)->samples > samples + 20; });
        EXPECT_EQ(seen.messages_but_of_silence(), "");
    }
    ASSERT_EQ(kill(children().front(), SIGTERM), 0);
    watch_until(hub, 2, seen, [&] { return seen.count(Kind::restarted) == 1; });
    const std::uint64_t before = hub.newest(0)->samples;
    watch_until(hub, 2, seen, [&] { return hub.newest(0)->samples > before + 10; });
    EXPECT_EQ(
        seen.messages_but_of_silence(),
        "sensor left: its process was killed by signal 15; started again (1 of at most 5 times in 10 s)\n");
    EXPECT_FALSE(hub.ended());
}

TEST(SensorHub, GivesUpOnASensorThatDiesAgainAndAgain) {
    SensorHub hub(options_for("trace:flourish", {"left"}));
    Watched seen;
    watch_until(hub, 1, seen, [&] {
        if (seen.count(Kind::failed) == 0)
            for (const int child : children()) kill(child, SIGKILL);
        return seen.count(Kind::failed) != 0;
    });
    EXPECT_EQ(hub.restarts(), 5);
    EXPECT_EQ(seen.events.back().message,
              "sensor left: failed: its process was killed by signal 9 after 5 restarts in 10 s; it is not "
              "started again");
    EXPECT_TRUE(hub.ended());
    EXPECT_EQ(children(), std::vector<int>{});
}

TEST(SensorHub, TakesWhatWasLearnedOfTheSensorsThatSayIt) {
    app::SensorOptions options = options_for("trace:flourish");
    options.keep_learned = true;
    SensorHub hub(options);
    Watched seen;
    watch_until(hub, 2, seen, [&] { return !seen.states[0].empty() && !seen.states[1].empty(); });
    ASSERT_EQ(children().size(), 2u);
    ASSERT_EQ(kill(children().back(), SIGKILL), 0);  // that of the right stick; none looks after it any more
    const app::LearnedBySticks learned = hub.end_and_take_learned();
    EXPECT_EQ(learned.experiences.size(), 1u);
    EXPECT_EQ(learned.silent, std::vector<std::string>{"right"});
}

TEST(SensorHub, TellsOfAStallAndLosesNoSample) {
    const TemporaryFolder folder;
    const fs::path file = folder.write("short.csv", cut_of("roll", 0, 1.5));
    app::SensorOptions options = options_for("trace:" + file.string(), {"right"});
    // The sensor has begun by then, and the stall is seen by a test that is held up for half of it. It lasts to the
    // source's end: that what came ends the silence is told before that the source has ended.
    options.epoch_ns += 2'000'000'000;
    options.stall_at_s = 0.5;
    options.stall_s = 1;
    SensorHub hub(options);
    Watched seen;
    watch_until(hub, 1, seen, [&] { return seen.count(Kind::ended) == 1; });
    // Silences of a machine that is held up may be among them.
    const std::string messages = seen.all_messages();
    double longest = 0;
    for (const SensorEvent& event : seen.events)
        if (const std::string words = "back after "; event.kind == Kind::back)
            longest =
                std::max(longest, std::stod(event.message.substr(event.message.find(words) + words.size())));
    EXPECT_GE(longest, 0.95) << messages;
    EXPECT_LT(longest, 20) << messages;
    const std::size_t silent = messages.find("sensor right: silent for 0."),
                      back = messages.find("sensor right: back after ", silent);
    EXPECT_NE(silent, std::string::npos) << messages;
    ASSERT_NE(back, std::string::npos) << messages;
    EXPECT_NE(messages.find("(last sample at 0.", silent), std::string::npos) << messages;
    EXPECT_EQ(hub.newest(0)->samples, 180u);
}

TEST(SensorHub, SensorsEndWithTheirApplication) {
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const pid_t application = fork();
    if (application == 0) {
        SensorHub hub(options_for("trace:flourish"));
        const std::vector<int> sensors = children();
        (void)!write(ends[1], sensors.data(), sensors.size() * sizeof(int));
        pause();
    }
    int sensors[2] = {};
    ASSERT_EQ(read(ends[0], sensors, sizeof sensors), static_cast<ssize_t>(sizeof sensors));
    close(ends[0]);
    close(ends[1]);
    kill(application, SIGKILL);
    waitpid(application, nullptr, 0);
    const std::int64_t until = app::monotonic_ns() + 10'000'000'000;
    const auto runs = [](int pid) {
        std::ifstream status("/proc/" + std::to_string(pid) + "/stat");
        std::string text;
        std::getline(status, text);
        return !text.empty() && text.find(") Z") == std::string::npos;
    };
    while ((runs(sensors[0]) || runs(sensors[1])) && app::monotonic_ns() < until) usleep(10'000);
    EXPECT_FALSE(runs(sensors[0]));
    EXPECT_FALSE(runs(sensors[1]));
}

TEST(SensorHub, SharesMemoryThatHasNoNameAndUnmapsIt) {
    {
        SensorHub hub(options_for("trace:flourish", {"left"}));
        EXPECT_EQ(mapped_memories(), 1);
    }
    EXPECT_EQ(mapped_memories(), 0);
}

void expect_refused(const app::SensorOptions& options, const std::string& message) {
    try {
        SensorHub hub(options);
        FAIL() << "not refused";
    } catch (const app::BadInput& wrong) {
        EXPECT_NE(std::string(wrong.what()).find(message), std::string::npos) << wrong.what();
    }
    EXPECT_EQ(children(), std::vector<int>{});
}

TEST(SensorHub, RefusesWhatCannotBe) {
    expect_refused(options_for("trace:flourish", {"left", "middle"}),
                   "found no stick \"middle\", expected one of left, right");
    expect_refused(options_for("tape:x"),
                   "found source \"tape:x\", expected trace:FILE, stdin, zmq:ENDPOINT or osc:PORT");
    app::SensorOptions options = options_for("trace:flourish");
    options.predictors.sound = "oracle";
    expect_refused(options, "found predictor \"oracle\", expected auto, exec:CMD or one of");
    options.predictors.sound = "exec: ";
    expect_refused(options, "found predictor \"exec: \" without a command");
    options = options_for("trace:flourish");
    options.period_s = 2;
    expect_refused(options, "found a period of 2 s, expected more than its");
}

// Predictors of one's own, whose processes the sensor processes start.

/// Answers every sample with its position, each lead alike; `first` is done before.
std::string holding(const std::string& first = "") {
    return "exec:read head; set -- $head; name=$3; shift 3; n=$#; k=0; echo position; "
           "while read t x y z rest; do [ $t = restart ] && continue; k=$((k+1)); " +
           first + "a=; i=0; while [ $i -lt $n ]; do a=\"$a $x $y $z\"; i=$((i+1)); done; echo $a; done";
}

TEST(SensorHub, EveryPredictorHasAPathExternalOnesToo) {
    const TemporaryFolder folder;
    const fs::path file = folder.write("short.csv", cut_of("flourish", 0, 0.4));
    for (const std::string& sound : {std::string("least-squares:degree=3,n=8"), holding()}) {
        app::SensorOptions options = options_for("trace:" + file.string(), {"left"});
        options.predictors = app::stick_predictors("hold", sound, 0.08);
        options.period_s = 0.6;
        SensorHub hub(options);
        Watched seen;
        watch_until(hub, 1, seen, [&] { return !seen.states[0].empty() && seen.states[0].back().lap >= 2; });
        EXPECT_EQ(seen.messages_but_of_silence(), "");
        for (const tracking::StickState& state : seen.states[0]) {
            EXPECT_FALSE(state.sound.motion());
            EXPECT_TRUE(state.picture.motion());
            EXPECT_EQ(state.starts, state.lap + 1);
            if (sound.starts_with("exec:")) {
                EXPECT_EQ(state.sound.after(0.05).position, state.position);  // of this lap, to the bit
            }
        }
        // A lap's first sample is the first again, whatever the lap before has left.
        app::StickFilters filters(options.predictors, "left");
        const tracking::Trace trace = tracking::read_trace(file);
        tracking::StickState own;
        std::size_t next = 0;
        for (const tracking::StickState& state : seen.states[0]) {
            if (state.lap != seen.states[0].back().lap) continue;
            while (next < trace.sticks[0].samples.size() && trace.sticks[0].samples[next].t_s <= state.t_s)
                (void)filters.correct(trace.sticks[0].samples[next++], own);
            expect_same(state.sound.after(0.03), own.sound.after(0.03));
        }
    }
}

TEST(SensorHub, AnExternalPredictorThatDoesNotStartIsSaidInOneLine) {
    app::SensorOptions options = options_for("trace:flourish");
    for (const auto& [sound, message] :
         {std::pair{"exec:exit 5",
                    "exec:exit 5, stick left, first line: error: found the child ended with status 5"},
          {"exec:echo hello",
           "exec:echo hello, stick left, first line: error: found \"hello\", expected \"position"}}) {
        options.predictors.sound = sound;
        try {
            SensorHub hub(options);
            ADD_FAILURE() << sound;
        } catch (const std::runtime_error& wrong) {
            EXPECT_EQ(std::string(wrong.what()).find(message), 0U) << wrong.what();
        }
        EXPECT_EQ(children(), std::vector<int>{});
    }
}

TEST(SensorHub, ADeadExternalPredictorFailsItsStickAlone) {
    const TemporaryFolder folder;
    const fs::path file = folder.write("short.csv", cut_of("roll", 0, 1.0));
    app::SensorOptions options = options_for("trace:" + file.string());
    options.predictors = app::stick_predictors("hold", "hold", 0.05);
    // The left stick's dies of its tenth sample.
    options.predictors.sound = holding("[ $name = left ] && [ $k = 10 ] && kill -9 $$; ");
    SensorHub hub(options);
    Watched seen;
    watch_until(hub, 2, seen, [&] { return seen.count(Kind::failed) == 1 && seen.count(Kind::ended) == 1; });
    EXPECT_NE(seen.all_messages().find("sensor left: failed: exec:read head"), std::string::npos)
        << seen.all_messages();
    EXPECT_EQ(hub.newest(0)->samples, 9u);
    EXPECT_EQ(hub.newest(1)->samples, 120u);
    EXPECT_TRUE(hub.ended());
    EXPECT_EQ(hub.restarts(), 0);
}

}  // namespace
