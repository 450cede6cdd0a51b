// Live play among strays, noise and sensors that are killed, for as long as is asked for: MUSICWORLD_SOAK_S seconds, an
// hour with MUSICWORLD_LONG, a few seconds otherwise. Last a disk that gets full while it plays.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/socket.h>
#include <unistd.h>

#include <bit>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "program.h"

namespace end_to_end {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

double soak_seconds() {
    if (const char* asked = std::getenv("MUSICWORLD_SOAK_S")) return std::stod(asked);
    return std::getenv("MUSICWORLD_LONG") ? 3600 : 8;
}

/// Two sticks that beat the air, each with a sender whose clock is another, and what else comes to a port.
class Senders {
public:
    explicit Senders(int port) {
        to_.sin_family = AF_INET;
        to_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        to_.sin_port = htons(static_cast<std::uint16_t>(port));
        thread_ = std::jthread([this](const std::stop_token& stop) { send_until(stop); });
    }
    ~Senders() {
        thread_ = {};
        close(socket_);
    }
    Senders(const Senders&) = delete;
    Senders& operator=(const Senders&) = delete;

private:
    template <class Number>
    static void append(std::string& bytes, Number value) {
        char raw[sizeof value];
        std::memcpy(raw, &value, sizeof value);
        for (std::size_t i = sizeof value; i > 0; --i) bytes += raw[i - 1];  // highest first
    }
    static std::string pose(std::string stick, double t_s, double height) {
        stick.resize(stick.size() / 4 * 4 + 4);
        std::string bytes = stick + std::string(",dfff\0\0\0", 8);
        append(bytes, t_s);
        for (const double coordinate : {0.0, height, -0.4}) append(bytes, static_cast<float>(coordinate));
        return bytes;
    }
    void send(const std::string& bytes) const {
        (void)sendto(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to_),
                     sizeof to_);
    }
    void send_until(const std::stop_token& stop) const {
        std::mt19937 random(5);
        for (Clock::time_point next = Clock::now(); !stop.stop_requested();
             std::this_thread::sleep_until(next += 8ms)) {
            const double t = std::chrono::duration<double>(next.time_since_epoch()).count();
            const double height = 0.95 - 0.25 * std::cos(12 * t);
            send(pose("/left", t, height));
            send(pose("/right", t + 3600, height));
            if (random() % 4 != 0) continue;
            send(pose(random() % 2 ? "/left" : "/right", std::ldexp(1, static_cast<int>(random() % 60)), 5));
            send(pose("/other" + std::to_string(random() % 100), t, 1));
            std::string noise(random() % 200, 'x');
            for (char& c : noise) c = static_cast<char>(random());
            send(noise);
        }
    }

    const int socket_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in to_{};
    std::jthread thread_;
};

double resident_mib(int pid) {
    std::ifstream file("/proc/" + std::to_string(pid) + "/statm");
    double all = 0, resident = 0;
    file >> all >> resident;
    return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

long descriptors(int pid) {
    std::error_code none;
    const auto all = std::filesystem::directory_iterator("/proc/" + std::to_string(pid) + "/fd", none);
    return std::distance(begin(all), end(all));
}

/// The process's sensors.
std::vector<int> sensors_of(int pid) {
    std::ifstream children("/proc/" + std::to_string(pid) + "/task/" + std::to_string(pid) + "/children");
    std::vector<int> sensors;
    for (int child = 0; children >> child;)
        if (read("/proc/" + std::to_string(child) + "/cmdline").find(std::string("\0sensor\0", 8)) !=
            std::string::npos)
            sensors.push_back(child);
    return sensors;
}

int free_port() {
    const int probe = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    socklen_t size = sizeof address;
    (void)bind(probe, reinterpret_cast<sockaddr*>(&address), size);
    (void)getsockname(probe, reinterpret_cast<sockaddr*>(&address), &size);
    close(probe);
    return ntohs(address.sin_port);
}

/// What is left to be said of a soak: nothing, or, of a machine that takes long to start a sensor, what did not come about.
std::string soak(double seconds, std::chrono::seconds between_kills) {
    const Folder folder;
    const int port = free_port();
    Started play({"play", "--realtime", "--source", "osc:" + std::to_string(port), "--seconds",
                  std::to_string(seconds + 2), "--no-frames", "--out", folder / "run"},
                 folder / "");
    const Senders senders(port);
    std::mt19937 random(3);
    const Clock::time_point start = Clock::now();
    const auto passed = [&start] { return std::chrono::duration<double>(Clock::now() - start).count(); };
    // By then the ring is touched, the sound's tables are made, and of each log of samples, blocks and sound has been in
    // memory what ever is, half a MiB. Those of notes, leads and events fill theirs later: 3 MiB in all.
    const double settled_s = std::min(120.0, seconds / 2);
    long descriptors_first = 0, kills = 0;
    double resident_first = 0, told = 0;
    while (passed() < seconds) {
        std::this_thread::sleep_for(between_kills);
        const std::vector<int> sensors = sensors_of(play.pid());
        if (sensors.empty()) continue;
        if (resident_first == 0 && passed() > settled_s) {
            descriptors_first = descriptors(play.pid());
            resident_first = resident_mib(play.pid());
        }
        kill(sensors[random() % sensors.size()], random() % 2 ? SIGKILL : SIGTERM);  // at most 5 in 10 s
        ++kills;
        if (passed() > told + seconds / 20)
            std::printf("%6.0f s: %ld sensors ended, %.1f MiB, %ld descriptors\n", told = passed(), kills,
                        resident_mib(play.pid()), descriptors(play.pid()));
    }
    const long descriptors_last = descriptors(play.pid());
    const double before_end_mib = resident_mib(play.pid());
    const Ended ended = play.wait();
    std::printf("%6.0f s: %ld sensors ended, %.1f MiB at first, %.1f MiB at last, status %d\n", passed(),
                kills, resident_first, before_end_mib, ended.status);
    EXPECT_EQ(ended.status, 0) << ended.err;
    if (resident_first == 0 ||
        ended.err.find("sensor left, right: their clocks are 3600.0") == std::string::npos)
        return ended.err + " (kills: " + std::to_string(kills) + ")";
    EXPECT_LE(descriptors_last, descriptors_first + 1);  // one of a pipe or file that is open just now
    // Before that the pages of the ring and of the logs are still being touched for the first time.
    const double unsettled_mib = settled_s < 120 ? 30 : 0;
    EXPECT_LE(before_end_mib, 1.1 * resident_first + unsettled_mib);
    EXPECT_EQ(ended.err.find("has ended"), std::string::npos) << ended.err;
    const auto summary = nlohmann::json::parse(read(folder / "run/summary.json"));
    // A sensor that is started again may hear a stray first, whose clock it then takes for the stick's until the third
    // sample.
    for (const auto& clock : summary["realtime"]["sensors"]["clocks"]) EXPECT_LE(clock["jumps"], 1);
    return {};
}

TEST(LiveSoak, StraysNoiseAndKilledSensorsEndNothingAndCostNoDescriptors) {
    std::string left;
    for (const int times : {1, 4}) {
        left = soak(soak_seconds() * times, 3s * times);
        if (left.empty() || soak_seconds() > 60 || HasFailure()) break;
    }
    EXPECT_EQ(left, "");
}

/// A file system of so many MiB; none without the right to mount.
class SmallDisk {
public:
    SmallDisk(std::filesystem::path at, int mib) : at_(std::move(at)) {
        std::filesystem::create_directory(at_);
        mounted_ = mount("none", at_.c_str(), "tmpfs", 0, ("size=" + std::to_string(mib) + "m").c_str()) == 0;
    }
    ~SmallDisk() {
        if (mounted_) umount2(at_.c_str(), MNT_DETACH);
    }
    SmallDisk(const SmallDisk&) = delete;
    SmallDisk& operator=(const SmallDisk&) = delete;
    [[nodiscard]] bool mounted() const { return mounted_; }
    void fill() const {
        std::ofstream file(at_ / "ballast", std::ios::binary);
        const std::string block(1 << 16, 'x');
        while (file.write(block.data(), static_cast<std::streamsize>(block.size())).flush()) {
        }
    }

private:
    std::filesystem::path at_;
    bool mounted_ = false;
};

TEST(LiveSoak, ADiskThatGetsFullWhileItPlaysEndsItInOneLineAndNothingLooksFinished) {
    const Folder folder;
    const SmallDisk disk(folder / "disk", 64);
    if (!disk.mounted()) GTEST_SKIP() << "needs the right to mount";
    const int port = free_port();
    Started play({"play", "--realtime", "--source", "osc:" + std::to_string(port), "--seconds", "600",
                  "--no-frames", "--out", folder / "disk/run"},
                 folder / "");
    const Senders senders(port);
    const auto playing = [&] { return !sensors_of(play.pid()).empty(); };
    for (int i = 0; i < 600 && !playing(); ++i) std::this_thread::sleep_for(100ms);
    std::this_thread::sleep_for(4s);
    ASSERT_TRUE(playing());
    const Clock::time_point full = Clock::now();
    disk.fill();
    const Ended ended = play.wait();
    // A quarter of a MiB of sound is less than a second; the ten minutes that were asked for are far off.
    EXPECT_LT(Clock::now() - full, 120s);
    EXPECT_EQ(ended.status, 1) << ended.err;
    EXPECT_NE(ended.err.find("No space left on device"), std::string::npos) << ended.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "disk/run/summary.json"));
    EXPECT_FALSE(std::filesystem::exists(folder / "disk/run/audio.wav"));
}

}  // namespace
}  // namespace end_to_end
