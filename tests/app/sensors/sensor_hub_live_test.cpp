// A live source that serves two sticks from one process. Waits are bounded by seconds, so that a loaded machine passes.
#include <gtest/gtest.h>
#include <lo/lo.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <thread>
#include <zmq.hpp>

#include "free_port.h"
#include "sensors/watched_hub.h"

namespace {

using namespace app_test;

/// Sends poses of both sticks over OSC with a clock of its own, from a thread.
class OscSender {
public:
    explicit OscSender(int port) : to_(lo_address_new("127.0.0.1", std::to_string(port).c_str())) {
        thread_ = std::jthread([this](const std::stop_token& stop) {
            while (!stop.stop_requested()) {
                send();
                app::sleep_until_ns(app::monotonic_ns() + 5'000'000);
            }
        });
    }
    ~OscSender() {
        thread_ = {};
        lo_address_free(to_);
    }
    OscSender(const OscSender&) = delete;
    OscSender& operator=(const OscSender&) = delete;
    void turn_clock_by(double seconds) { ahead_s_ = ahead_s_ + seconds; }
    /// Sends samples from other times and another place, too, before every fourth of its own.
    void stray(bool strays) { strays_ = strays; }
    /// The right stick's sender is another one, with a clock so far ahead.
    void set_right_apart(double seconds) { right_apart_s_ = seconds; }
    void pause(bool paused) { paused_ = paused; }
    void send_rubbish() { lo_send(to_, "/left", "s", "rubbish"); }

private:
    void send() {
        if (paused_) return;
        const double t = static_cast<double>(app::monotonic_ns()) * 1e-9;
        for (const char* stick : {"/left", "/right"})
            if (strays_ && sent_ % 4 == 0)
                lo_send(to_, stick, "dfff", t + ahead_s_ + 5e7 * (sent_ % 9 - 4.5), 9.0F, 9.0F, 9.0F);
        ++sent_;
        for (const char* stick : {"/left", "/right"})
            lo_send(to_, stick, "dfff", t + ahead_s_ + (stick[1] == 'r' ? right_apart_s_.load() : 0), 0.1F,
                    1 + 0.1F * static_cast<float>(std::sin(9 * t)), 0.0F);
    }

    lo_address to_;
    std::atomic<double> ahead_s_ = 1e9, right_apart_s_ = 0;
    std::atomic<bool> paused_ = false, strays_ = false;
    int sent_ = 0;
    std::jthread thread_;
};

TEST(SensorHub, LiveSticksShareAProcessAndSurviveWhatHappensToIt) {
    const int port = app::free_udp_port();
    const app::SensorOptions options = options_for("osc:" + std::to_string(port));
    SensorHub hub(options);
    EXPECT_EQ(children().size(), 1u);
    OscSender sender(port);
    Watched seen;
    const auto grown_by = [&](std::uint64_t more) {
        return [&seen, more, left = seen.states[0].empty() ? 0 : seen.states[0].back().samples,
                right = seen.states[1].empty() ? 0 : seen.states[1].back().samples] {
            return !seen.states[0].empty() && !seen.states[1].empty() &&
                   seen.states[0].back().samples > left + more &&
                   seen.states[1].back().samples > right + more;
        };
    };
    seen.states.resize(2);
    watch_until(hub, 2, seen, grown_by(100));
    EXPECT_EQ(seen.messages_but_of_silence(), "");
    EXPECT_EQ(hub.clocks().at(0).clock, app::SampleClock::source);

    sender.turn_clock_by(-7);
    watch_until(hub, 2, seen, [&] { return seen.count(Kind::clock_jumped) == 2; });
    sender.send_rubbish();
    watch_until(hub, 2, seen, [&] { return seen.count(Kind::malformed) == 1; });
    sender.pause(true);
    watch_until(hub, 2, seen, [&] { return seen.count(Kind::silent) >= 2; });
    sender.pause(false);
    watch_until(hub, 2, seen, [&] { return seen.count(Kind::back) >= 2; });
    kill(children().front(), SIGKILL);
    watch_until(hub, 2, seen, [&] { return seen.count(Kind::restarted) == 1; });
    watch_until(hub, 2, seen, grown_by(100));

    const std::string messages = seen.all_messages();
    for (const std::string stick : {"left", "right"})
        EXPECT_NE(messages.find("sensor " + stick + ": the source's clock jumped by -7.0"), std::string::npos)
            << messages;
    EXPECT_NE(messages.find("sensor left, right: left out what it could not read: osc /left: error: found 1 "
                            "arguments, expected 3"),
              std::string::npos)
        << messages;
    EXPECT_EQ(hub.restarts(), 1);
    for (std::size_t stick = 0; stick < 2; ++stick) {
        const tracking::StickState* before = nullptr;
        for (const tracking::StickState& state : seen.states[stick]) {
            // The times are ours, counted from the epoch.
            EXPECT_NEAR(static_cast<double>(state.due_ns - options.epoch_ns) * 1e-9, state.t_s, 1e-9);
            EXPECT_NEAR(static_cast<double>(state.read_ns - options.epoch_ns) * 1e-9, state.t_s, 5);
            if (before && before->starts == state.starts) {
                EXPECT_GT(state.t_s, before->t_s);
            }
            before = &state;
        }
    }
}

TEST(SensorHub, SendersWithClocksOfTheirOwnAreEachFollowedAndThatIsSaidOnce) {
    const int port = app::free_udp_port();
    const app::SensorOptions options = options_for("osc:" + std::to_string(port));
    SensorHub hub(options);
    OscSender sender(port);
    sender.set_right_apart(3600);
    Watched seen;
    watch_until(hub, 2, seen, [&] { return seen.count(Kind::clocks_apart) == 1; });
    const auto more = [&, samples = hub.newest(1)->samples] { return hub.newest(1)->samples > samples + 50; };
    watch_until(hub, 2, seen, more);
    const std::string messages = seen.messages_but_of_silence();
    EXPECT_TRUE(messages.starts_with("sensor left, right: their clocks are 3600.0") ||
                messages.starts_with("sensor left, right: their clocks are 3599.9"))
        << messages;
    EXPECT_EQ(std::count(messages.begin(), messages.end(), '\n'), 1) << messages;
    for (const auto& states : seen.states)
        for (const tracking::StickState& state : states)
            EXPECT_NEAR(static_cast<double>(state.read_ns - options.epoch_ns) * 1e-9, state.t_s, 5);
}

TEST(SensorHub, NoStrayIsEverPlayedNotEvenTheVeryFirst) {
    const int port = app::free_udp_port();
    SensorHub hub(options_for("osc:" + std::to_string(port)));
    OscSender sender(port);
    sender.stray(true);
    Watched seen;
    seen.states.resize(2);
    watch_until(hub, 2, seen, [&] { return seen.states[0].size() > 100 && seen.states[1].size() > 100; });
    for (const auto& states : seen.states)
        for (const tracking::StickState& state : states) EXPECT_LT(state.position.y(), 2);
}

TEST(SensorHub, AWallClockThatIsFarFromOursIsSaid) {
    const int port = app::free_udp_port();
    SensorHub hub(options_for("osc:" + std::to_string(port), {"left"}));
    OscSender sender(port);
    const double wall =
        std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
    sender.turn_clock_by(wall - 1e9 - static_cast<double>(app::monotonic_ns()) * 1e-9 + 120);
    Watched seen;
    watch_until(hub, 1, seen, [&] { return seen.count(Kind::clocks_apart) == 1; });
    EXPECT_TRUE(hub.clocks().at(0).wall);
    EXPECT_NEAR(hub.clocks().at(0).ahead_s, 120, 5);  // 5: a machine held up
    EXPECT_NE(seen.all_messages().find("s ahead of this machine's"), std::string::npos)
        << seen.all_messages();
}

TEST(SensorHub, HeadOfAStreamIsThereBeforeItsFirstStateAndOutlivesTheSensor) {
    zmq::context_t context;
    zmq::socket_t publisher(context, zmq::socket_type::pub);
    publisher.set(zmq::sockopt::linger, 0);
    publisher.bind("tcp://127.0.0.1:*");
    SensorHub hub(options_for("zmq:" + publisher.get(zmq::sockopt::last_endpoint), {"left"}));
    const std::string head = "# units: mm\n# tip_m: 0,0,-0.4\nt,stick,px,py,pz\n";
    Watched seen;
    seen.states.resize(1);
    // The head only until the first state is seen: a message before the subscription is lost.
    const auto send = [&] {
        const std::string row =
            std::to_string(1e-9 * static_cast<double>(app::monotonic_ns())) + ",left,1000,1500,0\n";
        publisher.send(zmq::buffer(seen.states[0].empty() ? head + row : row));
    };
    watch_until(hub, 1, seen, [&] { return send(), !seen.states[0].empty(); });
    EXPECT_EQ(hub.stream_head().text.data(), head);
    EXPECT_EQ(hub.stream_head().tip, Eigen::Vector3d(0, 0, -0.4));
    EXPECT_FALSE(hub.stream_head().shaft);
    kill(children().front(), SIGKILL);
    watch_until(hub, 1, seen, [&] { return send(), seen.count(Kind::restarted) == 1; });
    const std::size_t before = seen.states[0].size();
    watch_until(hub, 1, seen, [&] { return send(), seen.states[0].size() > before + 10; });
    EXPECT_EQ(hub.stream_head().text.data(), head);
    EXPECT_EQ(seen.states[0].back().starts, 2u);
    for (const tracking::StickState& state : seen.states[0])
        EXPECT_EQ(state.position, Eigen::Vector3d(1, 1.5, 0));
}

}  // namespace
