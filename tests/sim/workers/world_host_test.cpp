#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <array>
#include <atomic>
#include <future>
#include <mutex>
#include <random>
#include <thread>

#include "hostile_member.h"
#include "key_folder.h"
#include "messages/worker_messages.h"
#include "network_namespace.h"
#include "processes.h"
#include "sim/distributed_world.h"
#include "workers/heartbeat.h"
#include "workers/worker_process.h"
#include "world_processes.h"

// Real processes.
namespace {

using namespace std::chrono_literals;
using namespace sim_test;

// The programs that the tests start; these tests are never run by themselves.
TEST(WorldProcess, DISABLED_Works) {
    const std::vector<std::string> words = command_line();
    _exit(sim::run_worker(option(words, "--connect"), option(words, "--key")));
}

TEST(SharedWorldRun, OneAndThreeProcessesDoAllStepsKeepTheMomentumAndLeaveNoneBehind) {
    const sim::WorldScene scene = heap(18);
    for (const int count : {1, 3}) {
        Watcher watcher;
        const sim::DistributedResult result =
            sim::run_distributed(scene, for_steps(80), processes(count), watcher);
        EXPECT_EQ(result.steps, 80u);
        EXPECT_EQ(watcher.last_step, 80u);
        expect_momentum_kept(watcher, result);
        EXPECT_EQ(result.workers, count);
        EXPECT_EQ(result.lost, 0);
        EXPECT_TRUE(children_of(getpid()).empty());
    }
}

TEST(SharedWorldRun, KilledWorkersBodiesGoOnElsewhereDownToNone) {
    const sim::WorldScene scene = heap(12);
    Watcher watcher;
    watcher.act_at = {20, 60, 100};
    watcher.act = [] { ::kill(children_of(getpid()).front(), SIGKILL); };
    const sim::DistributedResult result = sim::run_distributed(scene, for_steps(300), processes(3), watcher);
    EXPECT_EQ(result.steps, 300u);
    EXPECT_EQ(result.lost, 3);
    EXPECT_GE(result.bodies_reowned, 12);
    EXPECT_TRUE(watcher.noted("no worker is left"));
}

TEST(SharedWorldRun, AStoppedWorkerIsGivenUpAndTheOthersFinish) {
    const sim::WorldScene scene = heap(9);
    Watcher watcher;
    watcher.act_at = {10};
    watcher.act = [] { ::kill(children_of(getpid()).front(), SIGSTOP); };
    const sim::DistributedResult result = sim::run_distributed(scene, for_steps(60), processes(2), watcher);
    EXPECT_EQ(result.steps, 60u);
    EXPECT_EQ(result.lost, 1);
    EXPECT_TRUE(children_of(getpid()).empty());
}

TEST(SharedWorldRun, AWorkerThatIsToldToEndGivesItsBodiesAwayAndNoneIsLost) {
    const sim::WorldScene scene = heap(9);
    for (const int signal : {SIGTERM, SIGINT, SIGHUP}) {
        Watcher watcher;
        watcher.act_at = {10};
        watcher.act = [signal] { ::kill(children_of(getpid()).front(), signal); };
        const sim::DistributedResult result =
            sim::run_distributed(scene, for_steps(400), processes(2), watcher);
        expect_momentum_kept(watcher, result);
        EXPECT_EQ(result.lost, 0) << signal << testing::PrintToString(watcher.notes);
        EXPECT_EQ(result.left, 1);
    }
}

// As it starts it has not asked to join, and from then on it leaves in order.
TEST(SharedWorldRun, AWorkerThatIsToldToEndAsItJoinsIsNotLost) {
    const sim::WorldScene scene = heap(9);
    for (int run = 0; run < 12; ++run) {
        Watcher watcher;
        std::jthread teller([run] {
            std::vector<pid_t> children;
            while ((children = children_of(getpid())).empty()) std::this_thread::sleep_for(100us);
            std::this_thread::sleep_for(run * 4ms);
            ::kill(children.front(), SIGTERM);
        });
        const sim::DistributedResult result =
            sim::run_distributed(scene, for_steps(400), processes(2), watcher);
        EXPECT_EQ(result.steps, 400u) << run;
        expect_momentum_kept(watcher, result);
        EXPECT_EQ(result.lost, 0) << run << testing::PrintToString(watcher.notes);
    }
}

TEST(SharedWorldRun, AWorkerThatJoinsLateTakesPart) {
    const sim::WorldScene scene = heap(9);
    sim::DistributedLaunch launch = processes(1);
    std::string endpoint;
    launch.listening = [&](const std::string& where) { endpoint = where; };
    std::optional<sim::WorkerProcess> late;
    Watcher watcher;
    watcher.act_at = {10};
    watcher.act = [&] { late.emplace(start_elsewhere(endpoint)); };
    sim::DistributedSettings settings = for_steps(3000);
    const sim::DistributedResult result = sim::run_distributed(scene, settings, launch, watcher);
    expect_momentum_kept(watcher, result);
    EXPECT_EQ(result.workers, 2);
    EXPECT_TRUE(comes_true([&] { return late->has_ended(); }));
    EXPECT_EQ(late->ending(), "exit status 0");
}

TEST(SharedWorldRun, TwoWorkersOverTcpWithKeysJoinAndOneWithoutAKeyAndGarbageChangeNothing) {
    const KeyFolder keys({"left", "right"});
    const sim::WorldScene scene = heap(9);
    sim::DistributedLaunch launch;
    launch.listen = "tcp://127.0.0.1:*", launch.keys = keys.path(), launch.expect = 2;
    std::vector<sim::WorkerProcess> workers;
    workers.reserve(3);
    zmq::context_t context;
    std::optional<zmq::socket_t> garbage;
    launch.listening = [&](const std::string& endpoint) {
        workers.push_back(start_elsewhere(endpoint));  // without a key
        garbage = sim::connect_worker(context, endpoint, {}, 0);
        for (const char* name : {"left.key", "right.key"})
            workers.push_back(start_elsewhere(endpoint, (keys.path() / name).string()));
    };
    Watcher watcher;
    watcher.act_at = {1};
    watcher.act = [&] {
        for (int i = 0; i < 100; ++i)
            (void)garbage->send(zmq::str_buffer("GET / HTTP/1.1"), zmq::send_flags::dontwait);
    };
    const sim::DistributedResult result = sim::run_distributed(scene, for_steps(100), launch, watcher);
    expect_momentum_kept(watcher, result);
    EXPECT_EQ(result.workers, 2);
    EXPECT_EQ(result.lost, 0);
    EXPECT_FALSE(workers[0].has_ended());  // it still waits for an answer
    for (int i : {1, 2}) EXPECT_TRUE(comes_true([&] { return workers[i].has_ended(); }));
}

/// A run with one worker of ours and a hostile one.
sim::DistributedResult run_with(HostileMember::Habit habit, const sim::WorldScene& scene, std::uint64_t steps,
                                Watcher& watcher, std::optional<HostileMember>& hostile) {
    sim::DistributedLaunch launch = processes(1);
    launch.listen = "tcp://127.0.0.1:*", launch.expect = 2;
    // On a busy machine a worker of ours may come to send no heartbeat for a second.
    launch.silence_s = habit == HostileMember::Habit::is_silent ? 4 : 20;
    launch.listening = [&](const std::string& endpoint) { hostile.emplace(endpoint, habit, 10); };
    sim::DistributedSettings settings = for_steps(steps);
    settings.market.trade = false;  // so that it keeps what it says it has
    return sim::run_distributed(scene, settings, launch, watcher);
}

TEST(SharedWorldRun, AMemberThatPublishesTheSameStatesAgainIsGivenUpAndTheOthersFinish) {
    const sim::WorldScene scene = heap(9);
    Watcher watcher;
    std::optional<HostileMember> hostile;
    const sim::DistributedResult result =
        run_with(HostileMember::Habit::republishes, scene, 60, watcher, hostile);
    EXPECT_EQ(result.steps, 60u);
    EXPECT_EQ(result.lost, 1);
    EXPECT_TRUE(watcher.noted("found states that are not its to publish"))
        << testing::PrintToString(watcher.notes);
    EXPECT_TRUE(comes_true([&] { return hostile->given_up(); }));
}

TEST(SharedWorldRun, AMemberThatFloodsAnotherWithOffersIsGivenUpAndTheOthersFinish) {
    const sim::WorldScene scene = heap(9);
    Watcher watcher;
    std::optional<HostileMember> hostile;
    const sim::DistributedResult result = run_with(HostileMember::Habit::offers, scene, 60, watcher, hostile);
    EXPECT_EQ(result.steps, 60u);
    EXPECT_EQ(result.lost, 1);
    // On a busy machine its thread may come to send no heartbeat for 1 s before it has sent too much.
    EXPECT_TRUE(watcher.noted("found more messages than steps need") ||
                watcher.noted("worker 0 is lost: silent for too long") ||
                watcher.noted("worker 1 is lost: silent for too long"))
        << testing::PrintToString(watcher.notes);
}

// Whoever owns all waits for the answer to an offer, but not for long: else all would have waited for its bodies.
TEST(SharedWorldRun, AMemberThatAnswersNoOfferTakesNoWorkerOfOursWithIt) {
    const sim::WorldScene scene = heap(18);
    sim::DistributedLaunch launch = processes(1);
    launch.listen = "tcp://127.0.0.1:*", launch.expect = 2;
    launch.silence_s = 20, launch.longest_step_s = 5;
    std::optional<HostileMember> hostile;
    std::jthread later;
    launch.listening = [&](const std::string& endpoint) {
        later = std::jthread([&hostile, endpoint] {
            std::this_thread::sleep_for(std::chrono::milliseconds(300));  // ours is first and owns all
            hostile.emplace(endpoint, HostileMember::Habit::says_nothing, 0);
        });
    };
    sim::DistributedSettings settings = for_steps(60);
    settings.all_to_first = true;
    Watcher watcher;
    const sim::DistributedResult result = sim::run_distributed(scene, settings, launch, watcher);
    later.join();
    EXPECT_EQ(result.steps, 60u);
    EXPECT_LE(result.lost, 1) << testing::PrintToString(watcher.notes);  // 1: it came first on a busy machine
}

TEST(SharedWorldRun, AStrangerThatJoinsAndFallsSilentTakesNoWorkerOfOursWithIt) {
    const sim::WorldScene scene = heap(9);
    Watcher watcher;
    std::size_t ours = 0;
    watcher.act_at = {59};
    watcher.act = [&] { ours = children_of(getpid()).size(); };
    std::optional<HostileMember> hostile;
    const sim::DistributedResult result =
        run_with(HostileMember::Habit::is_silent, scene, 60, watcher, hostile);
    EXPECT_EQ(result.steps, 60u);
    EXPECT_EQ(result.lost, 1);
    EXPECT_EQ(ours, 1u);
}

TEST(SharedWorldRun, WorkersThatDoNotJoinInTimeAreLeftBehind) {
    const sim::WorldScene scene = heap(4);
    {
        Watcher watcher;
        sim::DistributedLaunch launch;  // one that was stopped before it joined behaves as this one
        launch.processes = {"/bin/sh", {"-c", "exec sleep 1000"}, 1};
        launch.wait_s = 0.4;
        EXPECT_EQ(sim::run_distributed(scene, for_steps(40), launch, watcher).steps, 40u);
        EXPECT_TRUE(watcher.noted("0 of 1 workers joined within 0 s"));
        EXPECT_TRUE(children_of(getpid()).empty());
    }
    Watcher watcher;
    sim::DistributedLaunch launch = processes(1);
    launch.listen = "tcp://127.0.0.1:*", launch.expect = 2, launch.wait_s = 3;
    EXPECT_EQ(sim::run_distributed(scene, for_steps(40), launch, watcher).workers, 1);
    EXPECT_TRUE(watcher.noted("1 of 2 workers joined within 3 s: the run begins without the others"));
}

TEST(SharedWorldRun, ARunWithAKillInMidRunFinishesAllStepsOfEveryBody) {
    sim::WorldScene scene;
    scene.world = world_test::on_floor();
    for (int i = 0; i < 9; ++i)
        scene.world.bodies.push_back(
            world_test::ball({1.5 * (i % 3), 0.8 + 0.1 * i, 1.5 * (i / 3)}, sim::Fidelity::modal));
    Watcher watcher;
    watcher.act_at = {50};
    watcher.act = [] { ::kill(children_of(getpid()).front(), SIGKILL); };
    sim::DistributedSettings settings = for_steps(240);
    const sim::DistributedResult result = sim::run_distributed(scene, settings, processes(3), watcher);
    EXPECT_EQ(result.steps, 240u);
    EXPECT_EQ(watcher.last_step, 240u);
    EXPECT_EQ(result.lost, 1);
    EXPECT_GE(result.bodies_reowned, 1);
    EXPECT_LE(result.largest_lead, 4);
    EXPECT_TRUE(result.quarantined.empty());
}

std::string port_of(const std::string& endpoint) {
    return endpoint.substr(endpoint.rfind(':'));
}

TEST(SharedWorldRun, ThreeHostsWithKeysFinishAlsoWhenOnesCableIsCut) {
    if (!OtherHost::possible()) GTEST_SKIP() << "network namespaces are not permitted here";
    const KeyFolder keys({"one", "two", "three"});
    const sim::WorldScene scene = heap(12);
    for (const bool cut : {false, true}) {
        const OtherHost one(1), two(2), three(3);
        sim::DistributedLaunch launch;
        launch.listen = "tcp://0.0.0.0:*", launch.keys = keys.path(), launch.expect = 3;
        std::vector<sim::WorkerProcess> workers;
        workers.reserve(3);
        launch.listening = [&](const std::string& endpoint) {
            const auto start = [&](const OtherHost& host, const char* key) {
                sim::WorkerLaunch there = host.there(run_test("WorldProcess.DISABLED_Works", 1));
                there.arguments.insert(there.arguments.end(), {"--key", (keys.path() / key).string()});
                workers.emplace_back(there, "tcp://" + host.here() + port_of(endpoint));
            };
            start(one, "one.key"), start(two, "two.key"), start(three, "three.key");
        };
        Watcher watcher;
        watcher.act_at = {10};
        watcher.act = [&] {
            if (cut) two.cut();
        };
        const sim::DistributedResult result = sim::run_distributed(scene, for_steps(100), launch, watcher);
        EXPECT_EQ(result.steps, 100u);
        if (!cut) expect_momentum_kept(watcher, result);
        EXPECT_EQ(result.workers, 3);
        EXPECT_EQ(result.lost, cut ? 1 : 0);
        EXPECT_EQ(result.bodies_reowned > 0, cut);
        for (sim::WorkerProcess& worker : workers)
            EXPECT_TRUE(comes_true([&] { return worker.has_ended(); }));  // the one cut off, too
    }
}

// Bodies wander from the first worker to the others all the while, so that what happens falls into trades.
// Kills and stops: a stop costs a second until it is noticed.
TEST(SharedWorldRun, EveryRunFinishesAmongTwentyRandomKillsStopsDrainsAndJoinsWhileBodiesAreTraded) {
    const int count = std::getenv("MUSICWORLD_LONG") ? 100 : 20;
    const sim::WorldScene scene = heap(9);
    std::mt19937 rng(4);
    std::uint64_t migrations = 0;
    for (int i = 0; i < count; ++i) {
        sim::DistributedLaunch launch = processes(3);
        std::string endpoint;
        launch.listening = [&](const std::string& where) { endpoint = where; };
        std::optional<sim::WorkerProcess> late;
        const unsigned what = rng() % 8, who = rng() % 3, delay_us = rng() % 3000;
        Watcher watcher;
        std::jthread fate;
        watcher.act_at = {1 + rng() % 150};
        watcher.act = [&] {
            if (what == 7) return late.emplace(start_elsewhere(endpoint)), void();
            fate = std::jthread([=, victim = children_of(getpid()).at(who)] {
                std::this_thread::sleep_for(std::chrono::microseconds(delay_us));
                ::kill(victim, what == 6 ? SIGSTOP : what >= 4 ? SIGTERM : SIGKILL);
            });
        };
        sim::DistributedSettings settings = for_steps(200);
        settings.all_to_first = true;
        const sim::DistributedResult result = sim::run_distributed(scene, settings, launch, watcher);
        if (fate.joinable()) fate.join();
        EXPECT_EQ(result.steps, 200u) << i;
        if (result.lost == 0) expect_momentum_kept(watcher, result);
        migrations += result.migrations;
    }
    EXPECT_GT(migrations, static_cast<std::uint64_t>(count));
    EXPECT_TRUE(children_of(getpid()).empty());
}

// An application for the next test: it starts two workers and goes on until it is killed.
TEST(WorldProcess, DISABLED_IsAnApplication) {
    sim::DistributedLaunch launch = processes(2);
    Watcher watcher;
    (void)sim::run_distributed(heap(6), for_steps(~0ull >> 1), launch, watcher);
}

TEST(SharedWorldRun, WorkersEndAndTheFolderGoesWhenTheApplicationIsKilled) {
    sim::WorkerProcess application(run_test("WorldProcess.DISABLED_IsAnApplication", 1), "none");
    std::vector<pid_t> ids;
    ASSERT_TRUE(comes_true([&] {
        ids = children_of(static_cast<pid_t>(application.id()));
        return ids.size() == 2 &&
               !option(command_line("/proc/" + std::to_string(ids[0])), "--connect").empty();
    }));
    const std::filesystem::path socket =
        option(command_line("/proc/" + std::to_string(ids[0])), "--connect").substr(6);
    std::this_thread::sleep_for(500ms);  // most likely in mid-run; either way they have to end
    application.kill();
    const auto ended = [](pid_t id) { return command_line("/proc/" + std::to_string(id)).empty(); };
    EXPECT_TRUE(comes_true([&] { return std::all_of(ids.begin(), ids.end(), ended); }));
    EXPECT_TRUE(comes_true([&] { return !std::filesystem::exists(socket.parent_path()); }));
}

/// Folders of this process's applications that workers find.
long folders() {
    const std::string name = "musicworld-" + std::to_string(getpid()) + "-";
    const auto all = std::filesystem::directory_iterator(std::filesystem::temp_directory_path());
    return std::count_if(begin(all), end(all), [&](const auto& entry) {
        return entry.path().filename().string().starts_with(name);
    });
}

// Workers of its own remove an application's folder if it is killed.
TEST(SharedWorldRun, AnApplicationWithoutWorkersOfItsOwnHasNoFolderThatCouldBeLeft) {
    std::optional<sim::WorkerProcess> worker;
    sim::DistributedLaunch launch;
    launch.processes = {"/nonexistent", {}, 0};
    launch.listen = "tcp://127.0.0.1:*", launch.expect = 1;
    launch.listening = [&](const std::string& endpoint) {
        EXPECT_EQ(folders(), 0);
        worker.emplace(start_elsewhere(endpoint));
    };
    Watcher watcher;
    EXPECT_EQ(sim::run_distributed(heap(2), for_steps(5), launch, watcher).steps, 5u);
}

TEST(SharedWorldRun, NobodyWhoJoinsAndAProgramThatEndsAtOnceAreErrors) {
    Watcher watcher;
    sim::DistributedLaunch launch;
    launch.expect = 1, launch.wait_s = 0.1;
    EXPECT_THROW((void)sim::run_distributed(heap(2), for_steps(5), launch, watcher), std::runtime_error);
    launch = {};
    launch.processes = {"/bin/false", {}, 1};
    EXPECT_THROW((void)sim::run_distributed(heap(2), for_steps(5), launch, watcher), std::runtime_error);
    launch = {};
    launch.listen = "tcp://0.0.0.0:*";
    EXPECT_THROW((void)sim::run_distributed(heap(2), for_steps(5), launch, watcher), std::invalid_argument);
}

}  // namespace
