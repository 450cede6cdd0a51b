#include "workers/peer_links.h"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <set>
#include <thread>

#include "key_folder.h"
#include "workers/socket_folder.h"

namespace {

using namespace std::chrono_literals;
using Clock = sim::PeerLinks::Clock;

constexpr std::size_t kMostParts = 20;
constexpr std::uint64_t kLastStep = 1000;
constexpr sim::Secret kOfOne = {1}, kOfTwo = {2};

/// Links of a worker. Two in one process have a context each, and the second one's socket another name.
struct End {
    explicit End(std::uint32_t self, const std::string& application,
                 const std::optional<sim::WorkerKeys>& keys = {}, sim::Pace pace = sim::Pace::lockstep)
        : links(context, {self, pace, application, keys, 1 << 20, kMostParts, kLastStep}) {}
    /// Takes what is there, for a while; parts are kept.
    void live(Clock::duration time) {
        for (const Clock::time_point start = Clock::now(); Clock::now() - start < time;
             std::this_thread::sleep_for(1ms))
            take();
    }
    void take() {
        links.look(Clock::now());
        while (std::optional<sim::DecodedMessage> part = links.receive(Clock::now()))
            parts.push_back(std::move(*part));
    }
    zmq::context_t context;
    sim::PeerLinks links;
    std::vector<sim::DecodedMessage> parts;
};

std::vector<std::uint8_t> part(std::uint32_t worker, std::uint64_t step, std::uint8_t content) {
    return sim::encode({worker, 0, step}, sim::PartMessage{false, {content}});
}

bool comes(const std::function<bool()>& what, const std::function<void()>& meanwhile) {
    for (int i = 0; i < 3000; ++i) {  // only so that a broken test ends
        if (what()) return true;
        meanwhile();
        std::this_thread::sleep_for(1ms);
    }
    return false;
}

/// Over TCP within this machine: sockets in a folder are named by process, and these are two in one.
class Links : public testing::Test {
public:
    static void meet(End& one, End& two) {
        const auto [one_reach, two_reach] = std::pair(*one.links.reach(), *two.links.reach());
        one.links.add({{{2, two_reach.endpoint, two_reach.key, kOfTwo, kOfOne}}});
        two.links.add({{{1, one_reach.endpoint, one_reach.key, kOfOne, kOfTwo}}});
    }
    /// Both ways; nothing is on its way then.
    static bool come_up(End& one, End& two) {
        const bool up =
            comes([&] { return one.links.is_up(2) && two.links.is_up(1); }, [&] { one.take(), two.take(); });
        two.live(20ms);
        return up;
    }

protected:
    Links() { meet(one_, two_); }
    /// Past one_'s count of what it sent.
    void send_as_one(const sim::Secret& secret, std::uint64_t count, const std::vector<std::uint8_t>& bytes) {
        if (!forger_) {
            forger_.emplace(one_.context, zmq::socket_type::push);
            forger_->set(zmq::sockopt::linger, 0);
            forger_->connect(two_.links.reach()->endpoint);
        }
        std::vector<std::uint8_t> preamble(secret.begin(), secret.end());
        preamble.resize(24);
        std::memcpy(preamble.data() + 16, &count, sizeof count);
        (void)forger_->send(zmq::buffer(preamble), zmq::send_flags::sndmore);
        (void)forger_->send(zmq::buffer(bytes), zmq::send_flags::none);
    }
    struct Heard {
        std::map<std::uint64_t, std::vector<std::uint8_t>> parts;  ///< contents, by steps
        std::set<std::uint64_t> gave_up;                           ///< steps
    };
    /// What two_ hears until a part of this step.
    Heard heard_until(std::uint64_t last) {
        Heard heard;
        EXPECT_TRUE(comes(
            [&] {
                for (const sim::DecodedMessage& m : std::exchange(two_.parts, {})) {
                    const auto& p = std::get<sim::PartMessage>(m.message);
                    if (p.gave_up)
                        heard.gave_up.insert(m.header.step);
                    else
                        heard.parts[m.header.step].push_back(p.bytes.at(0));
                }
                return heard.parts.contains(last);
            },
            [&] { two_.take(); }));
        return heard;
    }
    const std::string application_ = "tcp://127.0.0.1:9";
    End one_{1, application_}, two_{2, application_};
    std::optional<zmq::socket_t> forger_;
};

TEST_F(Links, TellOthersInOrderOnceTheseSayThatTheyHear) {
    one_.links.begin_step();
    EXPECT_EQ(one_.links.send({2, 3}, part(1, 5, 0)), (std::vector<std::uint32_t>{2, 3}));
    ASSERT_TRUE(come_up(one_, two_));
    EXPECT_EQ(one_.links.send({2}, part(1, 5, 0)), std::vector<std::uint32_t>{2}) << "in mid-step";
    one_.links.begin_step();
    for (std::uint8_t i = 0; i < 10; ++i)
        EXPECT_EQ(one_.links.send({3, 2}, part(1, 6, i)), std::vector<std::uint32_t>{3});
    ASSERT_TRUE(comes([&] { return two_.parts.size() == 10; }, [&] { two_.take(); }));
    for (std::uint8_t i = 0; i < 10; ++i) {
        const sim::DecodedMessage& m = two_.parts[i];
        EXPECT_EQ(m.header.worker, 1u);
        EXPECT_EQ(m.header.step, 6u);
        EXPECT_EQ(std::get<sim::PartMessage>(m.message).bytes, std::vector<std::uint8_t>{i});
    }
    EXPECT_EQ(two_.links.refused(), 0u);
    EXPECT_GT(one_.links.sent(), 10 * part(1, 6, 0).size());
}

TEST_F(Links, AreNoMoreUsedOnceTheOtherOneWasWaitedForInVainAndServeAgainWhenItIsHeard) {
    ASSERT_TRUE(come_up(one_, two_));
    std::this_thread::sleep_for(600ms);  // as in a long step of the other one
    one_.take();
    EXPECT_TRUE(one_.links.is_up(2));
    one_.links.doubt(Clock::now());
    EXPECT_FALSE(one_.links.is_up(2));
    one_.links.begin_step();
    EXPECT_EQ(one_.links.send({2}, part(1, 1, 0)), std::vector<std::uint32_t>{2});
    EXPECT_TRUE(comes([&] { return !two_.links.is_up(1); }, [&] { two_.take(); })) << "it is told";
    ASSERT_TRUE(come_up(one_, two_));
    one_.links.keep({1, 3});
    one_.links.begin_step();
    EXPECT_EQ(one_.links.send({2}, part(1, 1, 0)), std::vector<std::uint32_t>{2}) << "it is no member";
    EXPECT_EQ(two_.links.refused(), 0u);
}

TEST_F(Links, OfWhoDoesNotKnowTheSecretAreNone) {
    ASSERT_TRUE(come_up(one_, two_));
    send_as_one({9}, 1, part(1, 5, 7));
    send_as_one({}, 1, part(1, 5, 7));
    ASSERT_TRUE(comes([&] { return two_.links.refused() == 2; }, [&] { one_.take(), two_.take(); }));
    EXPECT_TRUE(two_.parts.empty());
    EXPECT_TRUE(two_.links.is_up(1) && one_.links.is_up(2));
}

// A member that lies. No number of a step may make the other one work without end.
TEST(PeerLinks, OnWhichSomethingElseComesAreHeardNoMore) {
    std::vector<std::uint8_t> damaged = part(1, 5, 7);
    damaged[30] ^= 1;
    for (const std::vector<std::uint8_t>& bytes :
         {part(3, 5, 7), sim::encode({1, 0, 5}, sim::Drained{}), damaged, std::vector<std::uint8_t>{},
          part(1, 3, 7), part(1, kLastStep + 1, 7), part(1, ~std::uint64_t{0} - 1, 7),
          part(1, ~std::uint64_t{0}, 7)}) {
        End one(1, "tcp://127.0.0.1:9"), two(2, "tcp://127.0.0.1:9");
        Links::meet(one, two);
        ASSERT_TRUE(Links::come_up(one, two));
        one.links.begin_step();
        EXPECT_TRUE(one.links.send({2}, part(1, 4, 0)).empty());
        EXPECT_TRUE(one.links.send({2}, bytes).empty());
        EXPECT_TRUE(one.links.send({2}, part(1, 6, 0)).empty());
        ASSERT_TRUE(comes([&] { return two.links.refused() > 0 && !one.links.is_up(2); },
                          [&] { one.take(), two.take(); }));
        ASSERT_FALSE(two.parts.empty());
        EXPECT_EQ(two.parts.front().header.step, 4u);
        two.parts.erase(two.parts.begin());
        EXPECT_EQ(two.parts.size(), 3u);
        for (const sim::DecodedMessage& m : two.parts)
            EXPECT_TRUE(std::get<sim::PartMessage>(m.message).gave_up);
        EXPECT_FALSE(two.links.is_up(1));
    }
}

// By a beat it shows that something is missing, not of which step.
TEST_F(Links, OfTheStepAfterAGapThatABeatShowsNothingIsTaken) {
    ASSERT_TRUE(come_up(one_, two_));
    constexpr std::uint64_t kFrom = 1'000'000;
    send_as_one(kOfOne, kFrom, part(1, 50, 0));
    send_as_one(kOfOne, kFrom + 1, part(1, 52, 1));
    send_as_one(kOfOne, kFrom + 3, sim::encode({1, 0, 0}, sim::LinkBeat{true}));
    send_as_one(kOfOne, kFrom + 4, part(1, 100, 2));  // not its first
    send_as_one(kOfOne, kFrom + 5, part(1, 100, 3));
    send_as_one(kOfOne, kFrom + 6, part(1, 102, 4));
    const auto [heard, gave_up] = heard_until(102);
    EXPECT_EQ(heard, (std::map<std::uint64_t, std::vector<std::uint8_t>>{{52, {1}}, {102, {4}}}));
    for (const std::uint64_t step : {51, 52, 53, 99, 100, 101}) EXPECT_TRUE(gave_up.contains(step)) << step;
}

// A connection that breaks loses what is on its way, and ZeroMQ says nothing of that.
TEST_F(Links, OfAStepOfWhichAPartWasLostNoMoreIsTaken) {
    ASSERT_TRUE(come_up(one_, two_));
    constexpr std::uint64_t kFrom = 1'000'000;
    send_as_one(kOfOne, kFrom, part(1, 50, 0));  // what was before it is missed, too
    for (std::uint64_t i : {1, 2, 4, 5}) send_as_one(kOfOne, kFrom + i, part(1, 60, std::uint8_t(i)));
    send_as_one(kOfOne, kFrom + 6, part(1, 61, 6));
    send_as_one(kOfOne, kFrom + 7, part(1, 62, 7));
    const auto [heard, gave_up] = heard_until(62);
    EXPECT_EQ(heard, (std::map<std::uint64_t, std::vector<std::uint8_t>>{{60, {1, 2}}, {62, {7}}}));
    for (const std::uint64_t step : {49, 50, 51, 59, 60, 61}) EXPECT_TRUE(gave_up.contains(step)) << step;
    EXPECT_FALSE(gave_up.contains(62));
}

TEST_F(Links, WhoTellsMoreThanAStepNeedsIsHeardNoMoreAndLearnsIt) {
    ASSERT_TRUE(come_up(one_, two_));
    one_.links.begin_step();
    for (std::size_t i = 0; i < 3 * kMostParts; ++i)
        EXPECT_TRUE(one_.links.send({2}, part(1, 5, std::uint8_t(i))).empty());
    EXPECT_TRUE(comes([&] { return !one_.links.is_up(2); }, [&] { one_.take(), two_.take(); }));
    std::size_t parts = 0;
    bool gave_up = false;
    for (const sim::DecodedMessage& m : two_.parts) {
        const bool last = std::get<sim::PartMessage>(m.message).gave_up;
        parts += !last, gave_up = gave_up || last;
    }
    EXPECT_EQ(parts, 2 * kMostParts);
    EXPECT_TRUE(gave_up);
    one_.live(700ms), two_.take();
    EXPECT_FALSE(one_.links.is_up(2));
}

TEST(PeerLinks, ListenInTheApplicationsFolderAndGoWithIt) {
    std::string path;
    {
        const sim::SocketFolder folder;
        path = folder.path();
        End end(1, folder.endpoint());
        ASSERT_TRUE(end.links.reach());
        const std::string socket = end.links.reach()->endpoint;
        EXPECT_TRUE(std::filesystem::is_socket(socket.substr(6))) << socket;
        // Of a member that lies: not where another program may listen.
        for (const std::string& wrong :
             {std::string("ipc:///tmp/other"), std::string("tcp://127.0.0.1:22"), socket + "/../workers",
              "ipc://" + path + "/workers", std::string("ipc://" + path + "/peer-"),
              std::string("inproc://x"), std::string()}) {
            end.links.add({{{2, wrong, "", kOfTwo, kOfOne}}});
            end.links.begin_step();
            EXPECT_EQ(end.links.send({2}, part(1, 1, 0)), std::vector<std::uint32_t>{2});
        }
        std::ofstream(path + "/peer-12345") << "of a worker that was killed";
    }
    EXPECT_FALSE(std::filesystem::exists(path));
    const End elsewhere(1, "ipc:///tmp/named/by/somebody");
    EXPECT_FALSE(elsewhere.links.reach());
}

TEST(PeerLinks, OverTcpWithKeysHearThoseThatTheApplicationHasNamed) {
    const sim_test::KeyFolder keys({"one", "two", "other"});
    const auto key_of = [&](const char* name) {
        return sim::read_worker_keys(keys.path() / (std::string(name) + ".key"));
    };
    const std::string application = "tcp://127.0.0.1:9";
    End one(1, application, key_of("one")), two(2, application, key_of("two")),
        other(1, application, key_of("other")), without(1, application);
    ASSERT_TRUE(one.links.reach());
    EXPECT_EQ(one.links.reach()->key, key_of("one").pair.shown);
    const sim::ReachMessage first = *one.links.reach(), second = *two.links.reach();
    // With the right secret, and a key that nobody has named, or none.
    other.links.add({{{2, second.endpoint, second.key, kOfTwo, kOfOne}}});
    without.links.add({{{2, second.endpoint, "", kOfTwo, kOfOne}}});
    two.links.add({{{1, first.endpoint, first.key, kOfOne, kOfTwo}}});
    for (int i = 0; i < 300; ++i) other.take(), without.take(), two.take(), std::this_thread::sleep_for(1ms);
    EXPECT_FALSE(two.links.is_up(1));
    one.links.add({{{2, second.endpoint, second.key, kOfTwo, kOfOne}}});
    EXPECT_TRUE(
        comes([&] { return one.links.is_up(2) && two.links.is_up(1); }, [&] { one.take(), two.take(); }));
    // Keys that are none, and addresses of others without a key: nothing is connected, nothing breaks.
    End strict(3, application, key_of("one"));
    strict.links.add({{{2, second.endpoint, std::string(40, '~'), kOfTwo, kOfOne},
                       {4, second.endpoint, "short", kOfTwo, kOfOne},
                       {5, second.endpoint, "", kOfTwo, kOfOne},
                       {6, "tcp://*:4000", second.key, kOfTwo, kOfOne},
                       {7, "tcp://localhost:4000", second.key, kOfTwo, kOfOne}}});
    strict.links.begin_step();
    EXPECT_EQ(strict.links.send({2, 4, 5, 6, 7}, part(3, 1, 0)), (std::vector<std::uint32_t>{2, 4, 5, 6, 7}));
}

}  // namespace
