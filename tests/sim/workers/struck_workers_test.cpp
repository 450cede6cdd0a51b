#include "workers/struck_workers.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>
#include <zmq.hpp>

#include "messages/worker_messages.h"
#include "processes.h"
#include "sim/distributed_world.h"
#include "test_kit.h"

namespace {

using namespace std::chrono_literals;
using namespace sim_test;
namespace fs = std::filesystem;

sim::WorkerLaunch workers(int count) {
    return run_test("WorkerProcess.DISABLED_Serves", count);
}

// The program that the tests start as a worker; the disabled test is never run by itself.
TEST(WorkerProcess, DISABLED_Serves) {
    const std::string endpoint = option(command_line(), "--connect");
    ASSERT_FALSE(endpoint.empty());
    _exit(sim::run_worker(endpoint));
}

// The exact bits of a reply: what travels in an answer, in order.
std::vector<std::uint8_t> bits(const sim::StepReply& reply) {
    sim::ByteWriter out;
    for (const sim::ModalState& s : reply.states)
        out.matrix(s.q), out.matrix(s.q_dot), out.number(s.swing), out.number(s.swing_dot);
    for (const auto& picture : reply.pictures) {
        for (const sim::ModalState& s : picture)
            out.matrix(s.q), out.matrix(s.q_dot), out.number(s.swing), out.number(s.swing_dot);
    }
    for (const double c : reply.clearance_m) out.number(c);
    for (const sim::Contact& c : reply.contacts) {
        out.number(c.stick), out.number(c.body), out.number(c.t_s), out.number<std::uint8_t>(c.starts_inside);
        out.number(c.depth_m), out.number(c.speed_mps), out.number(c.zone);
        for (const auto& v : {c.point_world, c.normal_world, c.point_body, c.impulse_body}) out.matrix(v);
    }
    return out.bytes();
}

// Runs the scenario on `simulation` and on a local one; fails at the first step whose bits differ. `before`
// runs before each step.
template <typename Before>
void expect_same_bits(sim::Simulation& simulation, Scenario& scenario, int steps, Before before) {
    const auto local = sim::make_local_simulation(scenario.bodies());
    std::size_t contacts = 0;
    for (int i = 0; i < steps; ++i) {
        const sim::StepRequest request = scenario.next();
        before(i);
        const sim::StepReply reply = simulation.step(request), expected = local->step(request);
        ASSERT_EQ(bits(reply), bits(expected)) << "step " << i;
        contacts += reply.contacts.size();
        scenario.learn(reply);
    }
    EXPECT_GT(contacts, static_cast<std::size_t>(steps) / 4) << "the scenario hardly strikes";
}

TEST(StruckWorkers, NoneOneThreeAndMoreWorkersThanBodiesReplyWithTheSameBitsAsALocalSimulation) {
    for (const int count : {0, 1, 3, 12}) {
        Scenario scenario(7);
        const auto pool = sim::make_distributed_simulation(scenario.bodies(), workers(count));
        expect_same_bits(*pool, scenario, count == 12 ? 60 : 300, [](int) {});
        EXPECT_EQ(pool->report().count, count);
        EXPECT_EQ(pool->report().lost, 0);
        EXPECT_EQ(pool->report().bodies_reowned, 0);
    }
}

TEST(StruckWorkers, KilledWorkersAreReplacedWithTheSameBitsDownToNone) {
    Scenario scenario(8);
    const auto pool = sim::make_distributed_simulation(scenario.bodies(), workers(3));
    std::mt19937 rng(1);
    std::vector<std::jthread> killers;
    const int at[] = {20, 61, 107};
    expect_same_bits(*pool, scenario, 160, [&](int i) {
        if (std::find(std::begin(at), std::end(at), i) == std::end(at)) return;
        const std::vector<pid_t> left = children_of(getpid());
        const pid_t victim = left[rng() % left.size()];
        const auto delay =
            std::chrono::microseconds(rng() % 400);  // anywhere in the step that follows, whichever it is
        killers.emplace_back([=] { std::this_thread::sleep_for(delay), ::kill(victim, SIGKILL); });
    });
    EXPECT_EQ(pool->report().lost, 3);
    EXPECT_GE(pool->report().bodies_reowned,
              10);  // each of ten bodies at least once, when the last worker goes
}

TEST(StruckWorkers, AStoppedWorkerIsReplacedWithTheSameBits) {
    Scenario scenario(9);
    const auto pool = sim::make_distributed_simulation(scenario.bodies(), workers(2));
    expect_same_bits(*pool, scenario, 40, [&](int i) {
        if (i == 15) ::kill(children_of(getpid()).front(), SIGSTOP);
    });
    EXPECT_EQ(pool->report().lost, 1);
    EXPECT_EQ(pool->report().bodies_reowned, 5);
}

TEST(StruckWorkers, GarbageAndForgedMessagesToItsSocketDoNoHarm) {
    Scenario scenario(10);
    const auto pool = sim::make_distributed_simulation(scenario.bodies(), workers(2));
    const std::string endpoint =
        option(command_line("/proc/" + std::to_string(children_of(getpid()).front())), "--connect");
    zmq::context_t context;
    zmq::socket_t stranger(context, zmq::socket_type::dealer);
    stranger.set(zmq::sockopt::linger, 0);
    stranger.connect(endpoint);
    std::mt19937 rng(2);
    expect_same_bits(*pool, scenario, 100, [&](int i) {
        std::vector<std::uint8_t> noise(rng() % 300);
        for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(rng());
        stranger.send(zmq::buffer(noise), i % 3 ? zmq::send_flags::none : zmq::send_flags::sndmore);
        for (const sim::WorkerMessage& forged :
             {sim::WorkerMessage(sim::JoinRequest{{}, "forged"}), sim::WorkerMessage(sim::EndOfRun{}),
              sim::WorkerMessage(sim::Beat{}),
              sim::WorkerMessage(sim::StruckAnswer{1, static_cast<std::uint64_t>(i), {}})})
            stranger.send(zmq::buffer(sim::encode({}, forged)), zmq::send_flags::none);
    });
    EXPECT_EQ(pool->report().lost, 0);
}

TEST(StruckWorkers, WorkersThatDoNotJoinInTimeAreGivenUpWithTheSameBits) {
    Scenario scenario(10);
    const auto pool =
        sim::make_distributed_simulation(scenario.bodies(), {"/bin/sh", {"-c", "exec sleep 1000"}, 2, 0.3});
    expect_same_bits(*pool, scenario, 10, [](int) {});
    EXPECT_EQ(pool->report().lost, 2);
    EXPECT_TRUE(children_of(getpid()).empty());
}

TEST(StruckWorkers, AProgramThatIsMissingOrEndsAtOnceIsAnErrorAndLeavesNoFolder) {
    const auto launch = [](const char* program) {
        (void)sim::make_distributed_simulation(sim_test::kit(), {program, {}, 1});
    };
    EXPECT_THROW(launch("/nonexistent/program"), std::runtime_error);
    EXPECT_THROW(launch("/bin/false"), std::runtime_error);
}

TEST(StruckWorkers, AtItsEndWorkersAndFolderAreGone) {
    auto pool = sim::make_distributed_simulation(sim_test::kit(), workers(2));
    const std::vector<pid_t> ids = children_of(getpid());
    ASSERT_EQ(ids.size(), 2u);
    const fs::path folder =
        fs::path(option(command_line("/proc/" + std::to_string(ids[0])), "--connect").substr(6))
            .parent_path();
    EXPECT_EQ(fs::status(folder).permissions(), fs::perms::owner_all);
    pool.reset();
    EXPECT_TRUE(children_of(getpid()).empty());
    EXPECT_FALSE(fs::exists(folder));
}

// An application for the next test: it starts two workers and waits to be killed.
TEST(WorkerProcess, DISABLED_IsAnApplication) {
    const auto pool = sim::make_distributed_simulation(sim_test::kit(), workers(2));
    for (;;) pause();
}

TEST(StruckWorkers, WorkersEndAndRemoveTheFolderWhenTheirApplicationIsKilled) {
    sim::WorkerProcess application(run_test("WorkerProcess.DISABLED_IsAnApplication", 1), "none");
    std::vector<pid_t> ids;
    fs::path folder;
    ASSERT_TRUE(comes_true([&] {
        ids = children_of(static_cast<pid_t>(application.id()));
        if (ids.size() != 2) return false;
        // None yet in a process that was forked just now: ipc://FOLDER/...
        const std::string endpoint = option(command_line("/proc/" + std::to_string(ids[0])), "--connect");
        if (endpoint.size() > 6) folder = fs::path(endpoint.substr(6)).parent_path();
        return !folder.empty() && fs::exists(folder / "workers");
    }));
    application.kill();
    const auto ended = [](pid_t id) {
        return command_line("/proc/" + std::to_string(id)).empty();
    };  // gone, or a zombie of init's
    EXPECT_TRUE(comes_true([&] { return std::all_of(ids.begin(), ids.end(), ended); }));
    EXPECT_TRUE(comes_true([&] { return !fs::exists(folder); }));
}

}  // namespace
