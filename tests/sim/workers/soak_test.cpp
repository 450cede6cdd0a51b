// A shared world among everything that goes wrong at once, for as long as is asked for: MUSICWORLD_SOAK_S seconds, an
// hour with MUSICWORLD_LONG, a few seconds otherwise. Last a disk that is full when the results are written.
#include <gtest/gtest.h>
#include <malloc.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/socket.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <list>
#include <optional>
#include <random>

#include "hostile_member.h"
#include "simulate_command.h"
#include "world_processes.h"

namespace {

using namespace std::chrono_literals;
using namespace sim_test;

double soak_seconds() {
    if (const char* asked = std::getenv("MUSICWORLD_SOAK_S")) return std::stod(asked);
    return std::getenv("MUSICWORLD_LONG") ? 3600 : 6;
}

double resident_mib() {
    std::ifstream file("/proc/self/statm");
    double all = 0, resident = 0;
    file >> all >> resident;
    return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

/// What is allocated, in all arenas; what the allocator keeps for threads that have ended does not count. 0 under
/// sanitizers.
double allocated_mib() {
    const struct mallinfo2 info = mallinfo2();
    return static_cast<double>(info.uordblks + info.hblkhd) / (1 << 20);
}

long descriptors() {
    const auto all = std::filesystem::directory_iterator("/proc/self/fd");
    return std::distance(begin(all), end(all)) - 1;
}

/// Kills, stops and drains workers of a process, and starts others in their place.
class Fate {
public:
    Fate(std::string endpoint, unsigned seed, pid_t parent = getpid())
        : thread_([this, endpoint = std::move(endpoint), seed, parent](const std::stop_token& stop) {
              std::mt19937 random(seed);
              while (!stop.stop_requested()) {
                  std::this_thread::sleep_for(std::chrono::milliseconds(100 + random() % 400));
                  const std::vector<pid_t> all = children_of(parent);
                  if (!all.empty()) {
                      constexpr int kSignals[] = {SIGKILL, SIGKILL, SIGTERM, SIGTERM, SIGSTOP};
                      ::kill(all[random() % all.size()], kSignals[random() % std::size(kSignals)]);
                      ++blows_;
                  }
                  // Also where none is left: a run without workers waits for one.
                  std::erase_if(others_, [](sim::WorkerProcess& other) { return other.has_ended(); });
                  if (std::max(all.size(), others_.size()) < 6) others_.push_back(start_elsewhere(endpoint));
              }
          }) {}
    ~Fate() { thread_ = {}; }
    Fate(const Fate&) = delete;
    Fate& operator=(const Fate&) = delete;
    [[nodiscard]] int blows() const { return blows_; }

private:
    std::list<sim::WorkerProcess> others_;
    std::atomic<int> blows_ = 0;
    std::jthread thread_;
};

/// Sends noise, forged messages and requests to join, and connects without a word.
class Stranger {
public:
    Stranger(std::string endpoint, unsigned seed)
        : thread_([this, endpoint = std::move(endpoint), seed](const std::stop_token& stop) {
              std::mt19937 random(seed);
              zmq::context_t context;
              while (!stop.stop_requested()) {
                  zmq::socket_t socket = sim::connect_worker(context, endpoint, {}, 0);
                  const std::vector<FileOfSocket> idle = connections(endpoint);
                  for (int i = 0; i < 2000 && !stop.stop_requested(); ++i) {
                      if (socket.send(zmq::buffer(message(random)), zmq::send_flags::dontwait)) ++sent_;
                      if (i % 100 == 0) std::this_thread::sleep_for(2ms);
                  }
              }
          }) {}
    [[nodiscard]] int sent() const { return sent_; }

private:
    struct FileOfSocket {
        int number;
        explicit FileOfSocket(int n) : number(n) {}
        FileOfSocket(FileOfSocket&& other) noexcept : number(std::exchange(other.number, -1)) {}
        ~FileOfSocket() {
            if (number >= 0) close(number);
        }
    };
    static std::vector<FileOfSocket> connections(const std::string& endpoint) {
        sockaddr_in to{};
        to.sin_family = AF_INET;
        to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(endpoint.substr(endpoint.rfind(':') + 1))));
        std::vector<FileOfSocket> all;
        for (int i = 0; i < 20; ++i) {
            all.emplace_back(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
            (void)connect(all.back().number, reinterpret_cast<sockaddr*>(&to), sizeof to);
        }
        return all;
    }
    static std::vector<std::uint8_t> message(std::mt19937& random) {
        switch (random() % 4) {
            case 0:
                return sim::encode({static_cast<std::uint32_t>(random() % 8), 0, 0}, sim::Beat{{1}});
            case 1:
                return sim::encode({static_cast<std::uint32_t>(random() % 8), 0, 0}, sim::Drained{});
            case 2:
                if (random() % 100 == 0)
                    return sim::encode({}, sim::JoinRequest{sim::make_secret(), "a stranger"});
                [[fallthrough]];
            default: {
                std::vector<std::uint8_t> noise(random() % 300);
                for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random());
                return noise;
            }
        }
    }
    std::atomic<int> sent_ = 0;
    std::jthread thread_;
};

TEST(SharedWorldSoak, AmongKillsHostileMembersAndAFloodEveryRunFinishesAndMemoryAndDescriptorsStay) {
    const sim::WorldScene scene = heap(9);
    constexpr std::uint64_t kSteps = 1000;
    const double seconds = soak_seconds();
    const auto start = std::chrono::steady_clock::now();
    const auto passed = [&start] {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    std::mt19937 random(11);
    long descriptors_first = 0, blows = 0, sent = 0, runs = 0, lost = 0;
    double allocated_first = 0, told = 0;
    for (; runs < 3 || passed() < seconds; ++runs) {
        if (runs == 2 || (passed() < seconds / 4 && runs > 2))  // what is made once is there
            allocated_first = allocated_mib(), descriptors_first = descriptors();
        sim::DistributedLaunch launch = processes(3);
        launch.listen = "tcp://127.0.0.1:*", launch.longest_step_s = 2;
        std::optional<Fate> fate;
        std::optional<Stranger> stranger;
        std::optional<HostileMember> hostile;
        constexpr HostileMember::Habit kHabits[] = {
            HostileMember::Habit::republishes, HostileMember::Habit::offers, HostileMember::Habit::is_silent};
        launch.listening = [&](const std::string& endpoint) {
            fate.emplace(endpoint, static_cast<unsigned>(random()));
            stranger.emplace(endpoint, static_cast<unsigned>(random()));
            hostile.emplace(endpoint, kHabits[random() % 3], 50);
        };
        Watcher watcher;
        const sim::DistributedResult result = sim::run_distributed(scene, for_steps(kSteps), launch, watcher);
        ASSERT_EQ(result.steps, kSteps) << "run " << runs << ": " << testing::PrintToString(watcher.notes);
        blows += fate->blows(), sent += stranger->sent(), lost += result.lost;
        if (passed() > told + seconds / 20)
            std::printf(
                "%6.0f s: %ld runs, %ld blows, %ld workers lost, %ld messages of strangers, %.2f MiB "
                "allocated, %.1f MiB resident, %ld descriptors\n",
                told = passed(), runs + 1, blows, lost, sent, allocated_mib(), resident_mib(), descriptors());
    }
    EXPECT_TRUE(comes_true([] { return children_of(getpid()).empty(); }));
    EXPECT_EQ(descriptors(), descriptors_first);
    EXPECT_LE(allocated_mib(),
              1.1 * allocated_first + 1);  // 1 MiB: what threads that have ended kept for reuse
    EXPECT_GT(sent, 1000);
}

TEST(SharedWorldSoak, ADiskThatIsFullInTheEndIsSaidInOneLineAndNothingLooksFinished) {
    const std::filesystem::path disk =
        std::filesystem::path(testing::TempDir()) / ("disk" + std::to_string(getpid()));
    std::filesystem::create_directory(disk);
    if (mount("none", disk.c_str(), "tmpfs", 0, "size=64k") != 0) GTEST_SKIP() << "needs the right to mount";
    const std::string endpoint = free_endpoint();
    SimulateCommand run("benchmark100 --steps 300 --fps 1000 --workers 2 --listen " + endpoint + " --out " +
                        (disk / "run").string());
    run.wait_until_listening();
    const Fate fate(endpoint, 3, children_of(getpid()).front());
    const Stranger stranger(endpoint, 4);
    const SimulateCommand::Ended ended = run.wait();
    EXPECT_EQ(ended.status, 1) << ended.text;
    EXPECT_NE(ended.text.find("No space left on device"), std::string::npos) << ended.text;
    EXPECT_FALSE(std::filesystem::exists(disk / "run/summary.json"));
    EXPECT_FALSE(std::filesystem::exists(disk / "run/states.csv"));
    umount2(disk.c_str(), MNT_DETACH);
    std::filesystem::remove(disk);
}

}  // namespace
