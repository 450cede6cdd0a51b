#include "workers/worker_gate.h"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <map>
#include <random>

#include "key_folder.h"
#include "messages/worker_messages.h"
#include "workers/heartbeat.h"

namespace {

using namespace std::chrono_literals;
using Kind = sim::WorkerGate::Event::Kind;

/// A worker's socket in the hands of a test.
class Peer {
public:
    explicit Peer(const std::string& endpoint, const std::optional<sim::WorkerKeys>& keys = {})
        : socket_(sim::connect_worker(context_, endpoint, keys, 0)) {
        socket_.set(zmq::sockopt::rcvtimeo, 50);
    }
    void send(const sim::WorkerMessage& message, std::uint32_t worker = 0) {
        send_bytes(sim::encode({worker, 0, 0}, message));
    }
    void send_bytes(const std::vector<std::uint8_t>& bytes, bool more = false) {
        (void)socket_.send(zmq::buffer(bytes), more ? zmq::send_flags::sndmore : zmq::send_flags::dontwait);
    }
    /// Waits for room.
    void send_waiting(const sim::WorkerMessage& message, std::uint32_t worker) {
        const std::vector<std::uint8_t> bytes = sim::encode({worker, 0, 0}, message);
        while (!socket_.send(zmq::buffer(bytes), zmq::send_flags::none)) {
        }
    }
    std::optional<sim::WorkerMessage> receive() {
        zmq::message_t frame;
        if (!socket_.recv(frame)) return std::nullopt;
        return sim::decode_message({frame.data<std::uint8_t>(), frame.size()}).message;
    }

private:
    zmq::context_t context_;
    zmq::socket_t socket_;
};

/// Events until one of the kind comes; the limit is only there so that a broken test ends.
std::optional<sim::WorkerGate::Event> wait_for(
    sim::WorkerGate& gate, Kind kind, const std::function<void()>& meanwhile = [] {}) {
    for (int i = 0; i < 1000; ++i) {
        for (sim::WorkerGate::Event& event : gate.wait(10ms))
            if (event.kind == kind) return std::move(event);
        meanwhile();
    }
    return std::nullopt;
}

template <typename Message>
bool gets(Peer& peer) {
    for (int i = 0; i < 200; ++i)
        if (const auto message = peer.receive()) return std::holds_alternative<Message>(*message);
    return false;
}

std::shared_ptr<const std::vector<std::uint8_t>> shared(const sim::WorkerMessage& message) {
    return std::make_shared<const std::vector<std::uint8_t>>(sim::encode({}, message));
}

/// As a worker does, the peer says nothing before it has heard that it is a member: the gate admits it on a thread
/// of its own.
void join(sim::WorkerGate& gate, Peer& peer, std::uint32_t worker, const sim::Secret& secret = {1}) {
    peer.send(sim::JoinRequest{secret, "host"});
    const auto event = wait_for(gate, Kind::asks_to_join);
    ASSERT_TRUE(event);
    EXPECT_EQ(event->request.secret, secret);
    gate.admit(event->stranger, worker, event->request.secret);
    gate.send({worker}, shared(sim::Members{{worker}}));
    ASSERT_TRUE(gets<sim::Members>(peer));
}

TEST(WorkerGate, AMemberSendsAndIsReachedByItsNumberAndOverTcpToo) {
    sim::WorkerGate gate({"tcp://127.0.0.1:*", {}, 60});
    Peer near(gate.private_endpoint()), far(gate.endpoint());
    join(gate, near, 3);
    join(gate, far, 4);
    far.send(sim::OfferAnswer{3, 1, true}, 4);
    const auto event = wait_for(gate, Kind::message);
    ASSERT_TRUE(event);
    EXPECT_EQ(event->worker, 4u);
    EXPECT_EQ(event->bytes, sim::encode({4, 0, 0}, sim::OfferAnswer{3, 1, true}));
    gate.send({3, 4}, shared(sim::Members{{3, 4}}));
    EXPECT_TRUE(gets<sim::Members>(near));
    EXPECT_TRUE(gets<sim::Members>(far));
}

TEST(WorkerGate, AStrangersMessagesAreRefusedAndGarbageIsCountedAndAnsweredByNothing) {
    sim::WorkerGate gate({"", {}, 60});
    Peer member(gate.private_endpoint()), stranger(gate.private_endpoint());
    join(gate, member, 0);
    stranger.send(sim::Handover{1, 1, {}}, 0);
    EXPECT_TRUE(gets<sim::Refusal>(stranger));
    std::mt19937 rng(2);
    for (int i = 0; i < 300; ++i) {
        std::vector<std::uint8_t> noise(rng() % 300);
        for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(rng());
        stranger.send_bytes(noise, i % 3 == 0);
    }
    std::vector<std::uint8_t> forged = sim::encode({}, sim::JoinRequest{{2}, "x"});
    forged[8] ^= 1;  // its length
    stranger.send_bytes(forged);
    stranger.send(sim::JoinRequest{{9}, "the last"});
    const auto event = wait_for(gate, Kind::asks_to_join);
    ASSERT_TRUE(event);
    EXPECT_EQ(event->request.host, "the last");  // nothing before it came through
    EXPECT_GE(gate.refused_messages(), 200u);
    gate.send({0}, shared(sim::EndOfRun{}));
    EXPECT_TRUE(gets<sim::EndOfRun>(member));
}

TEST(WorkerGate, HeartbeatsFromASocketOfTheirOwnKeepAMemberAndTheirEndLosesItOnce) {
    sim::WorkerGate gate({"", {}, 0.6});
    Peer quiet(gate.private_endpoint()), heartbeat(gate.private_endpoint());
    join(gate, quiet, 5, {5});
    Peer other(gate.private_endpoint());
    join(gate, other, 6, {6});  // never beats
    const auto beat = [&] { heartbeat.send(sim::Beat{{5}}, 5); };
    const auto lost = wait_for(gate, Kind::lost, beat);
    ASSERT_TRUE(lost);
    EXPECT_EQ(lost->worker, 6u);
    EXPECT_TRUE(gets<sim::Beat>(heartbeat));  // answered
    const auto then = wait_for(gate, Kind::lost);
    ASSERT_TRUE(then);
    EXPECT_EQ(then->worker, 5u);
    for (const auto& event : gate.wait(100ms)) EXPECT_NE(event.kind, Kind::lost);
}

TEST(WorkerGate, NobodyBeatsForAnotherNorKeepsItFromBeating) {
    sim::WorkerGate gate({"", {}, 0.6});
    Peer mute(gate.private_endpoint()), none(gate.private_endpoint()), good(gate.private_endpoint());
    join(gate, mute, 1, {1, 2, 3});
    join(gate, none, 2, {});  // asked to join without a secret: nobody can beat for it
    join(gate, good, 3, {3});
    Peer stranger(gate.private_endpoint()), heartbeat(gate.private_endpoint());
    std::map<std::uint32_t, int> lost;
    for (int i = 0; i < 300 && (lost[1] == 0 || lost[2] == 0); ++i) {
        // The stranger comes first each time, with every number and with what it may guess.
        for (const std::uint32_t worker : {1u, 2u, 3u})
            for (const sim::Secret& secret : {sim::Secret{}, sim::Secret{1}, sim::Secret{1, 2, 4}})
                stranger.send(sim::Beat{secret}, worker);
        heartbeat.send(sim::Beat{{3}}, 3);
        for (const auto& event : gate.wait(10ms))
            if (event.kind == Kind::lost) ++lost[event.worker];
    }
    EXPECT_EQ(lost[1], 1);
    EXPECT_EQ(lost[2], 1);
    EXPECT_EQ(lost[3], 0);
    EXPECT_TRUE(gets<sim::Beat>(heartbeat));
    EXPECT_FALSE(stranger.receive());
}

TEST(WorkerGate, OfAFloodOfJoinsSomeComeThroughAndEachThatIsExpected) {
    sim::WorkerGate gate({"tcp://127.0.0.1:*", {}, 60});
    const sim::Secret own = sim::make_secret();
    gate.expect(own);
    Peer flood(gate.endpoint()), child(gate.private_endpoint());
    for (int i = 0; i < 5000; ++i) flood.send(sim::JoinRequest{sim::make_secret(), "flood"});
    EXPECT_TRUE(gets<sim::Refusal>(flood));
    child.send(sim::JoinRequest{own, "child"});
    unsigned strangers = 0;
    bool came = false;
    const auto answered = [&] { return strangers + gate.refused_messages(); };
    for (int i = 0; i < 2000 && (!came || answered() < 5000); ++i)
        for (const auto& event : gate.wait(10ms)) {
            came = came || event.request.host == "child";
            strangers += event.request.host == "flood";
        }
    EXPECT_TRUE(came);
    EXPECT_EQ(answered(), 5000u);
    EXPECT_LE(strangers, 256u + 4 * 20);  // 4 a second, at most 20 s
}

TEST(WorkerGate, WhatAStrangerSendsIsSmallAndWhatAMemberSaysOfItselfIsPrintable) {
    sim::WorkerGate gate({"", {}, 60});
    Peer stranger(gate.private_endpoint());
    stranger.send(sim::WorkerFailure{std::string(4096, 'x')});
    stranger.send(sim::JoinRequest{{1}, "\xff\xfe\x1b[2J\n\"host"});
    const auto event = wait_for(gate, Kind::asks_to_join);
    ASSERT_TRUE(event);
    EXPECT_EQ(event->request.host, "???[2J?\"host");
    EXPECT_EQ(gate.refused_messages(), 1u);
    EXPECT_FALSE(stranger.receive());  // nothing was read of it, so nothing is answered
}

TEST(WorkerGate, AMemberThatReadsNothingHasItsLinkBrokenAndTheOthersGetAll) {
    sim::WorkerGate::Settings settings;
    settings.most_waiting = 200;
    sim::WorkerGate gate(settings);
    zmq::context_t context;
    zmq::socket_t slow(context, zmq::socket_type::dealer);
    slow.set(zmq::sockopt::linger, 0);
    slow.set(zmq::sockopt::rcvhwm, 1);
    slow.connect(gate.private_endpoint());
    const std::vector<std::uint8_t> request = sim::encode({}, sim::JoinRequest{{1}, "slow"});
    (void)slow.send(zmq::buffer(request), zmq::send_flags::none);
    const auto event = wait_for(gate, Kind::asks_to_join);
    ASSERT_TRUE(event);
    gate.admit(event->stranger, 1, {1});
    Peer good(gate.private_endpoint());
    join(gate, good, 2, {2});
    const auto large = shared(sim::WorkerFailure{std::string(4000, 'x')});
    bool lost = false;
    int sent = 0, got = 0;
    for (; sent < 20000 && !lost; ++sent) {
        gate.send({1, 2}, large);
        got += gets<sim::WorkerFailure>(good);
        for (const auto& e : gate.wait(0ms)) lost = lost || (e.kind == Kind::lost && e.worker == 1);
        if (sent > 1000) std::this_thread::sleep_for(1ms);  // it is lost some time after its queue was full
    }
    EXPECT_TRUE(lost);
    EXPECT_EQ(got, sent);
}

TEST(WorkerGate, AMemberThatSendsFasterThanTheApplicationTakesIsHeldBackAndNothingOfItIsLost) {
    sim::WorkerGate gate({"", {}, 0.5});
    Peer fast(gate.private_endpoint());
    join(gate, fast, 1);
    Peer heartbeat(gate.private_endpoint());
    heartbeat.send(sim::Beat{{1}}, 1);
    ASSERT_TRUE(gets<sim::Beat>(heartbeat));
    constexpr std::uint32_t kMessages = 20000;
    std::jthread sender([&] {
        for (std::uint32_t i = 0; i < kMessages; ++i) fast.send_waiting(sim::OfferAnswer{0, i, true}, 1);
    });
    // The application is busy for a second, or longer on a machine that is. Silence is not judged meanwhile, and it is not
    // taken for gone.
    int beats = 0;
    const auto start = std::chrono::steady_clock::now();
    const auto busy = [&] { return std::chrono::steady_clock::now() - start; };
    while (busy() < 1s || (beats < 3 && busy() < 20s)) beats += heartbeat.receive().has_value();
    EXPECT_GE(beats, 3);
    std::uint32_t next = 0;
    std::size_t most = 0;
    for (int i = 0; i < 200'000 && next < kMessages; ++i) {
        const auto events = gate.wait(10ms);
        most = std::max(most, events.size());
        for (const auto& event : events) {
            ASSERT_EQ(event.kind, Kind::message) << event.why;
            EXPECT_EQ(event.bytes, sim::encode({1, 0, 0}, sim::OfferAnswer{0, next++, true}));
        }
    }
    EXPECT_EQ(next, kMessages);
    EXPECT_LE(most, 4096u);
}

/// The soft limit of descriptors while it lives.
class FewDescriptors {
public:
    explicit FewDescriptors(rlim_t most) {
        getrlimit(RLIMIT_NOFILE, &before_);
        const rlimit few{most, before_.rlim_max};
        setrlimit(RLIMIT_NOFILE, &few);
    }
    ~FewDescriptors() { setrlimit(RLIMIT_NOFILE, &before_); }
    FewDescriptors(const FewDescriptors&) = delete;
    FewDescriptors& operator=(const FewDescriptors&) = delete;

private:
    rlimit before_{};
};

/// A process that opens `count` connections to a port of this machine, without a word, and holds them until it is
/// killed.
class IdleConnections {
public:
    explicit IdleConnections(int count) {
        int ends[2];
        if (pipe(ends) != 0) throw std::runtime_error("no pipe");
        child_ = fork();
        if (child_ == 0) {
            sockaddr_in to{};
            to.sin_family = AF_INET;
            to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
            if (read(ends[0], &to.sin_port, sizeof to.sin_port) != sizeof to.sin_port) _exit(1);
            for (int i = 0; i < count; ++i) {
                const int descriptor = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0);
                (void)connect(descriptor, reinterpret_cast<sockaddr*>(&to), sizeof to);
            }
            pause();
        }
        close(ends[0]);
        start_ = ends[1];
    }
    ~IdleConnections() {
        kill(child_, SIGKILL);
        waitpid(child_, nullptr, 0);
        close(start_);
    }
    IdleConnections(const IdleConnections&) = delete;
    IdleConnections& operator=(const IdleConnections&) = delete;
    void open_to(const std::string& endpoint) {
        const auto port =
            htons(static_cast<std::uint16_t>(std::stoi(endpoint.substr(endpoint.rfind(':') + 1))));
        (void)!write(start_, &port, sizeof port);
    }

private:
    pid_t child_ = -1;
    int start_ = -1;
};

int open_descriptors() {
    const auto all = std::filesystem::directory_iterator("/proc/self/fd");
    return static_cast<int>(std::distance(begin(all), end(all))) - 1;
}

TEST(WorkerGate, IdleConnectionsLeaveDescriptorsForWhatIsWrittenAndMembersStay) {
    constexpr int kDescriptors = 1000;
    IdleConnections idle(1100);
    const FewDescriptors few(kDescriptors);
    sim::WorkerGate gate({"tcp://127.0.0.1:*", {}, 60});
    Peer member(gate.endpoint());
    join(gate, member, 1, {1});
    idle.open_to(gate.endpoint());
    int most = 0;
    for (int i = 0, after = 0; i < 1000 && after < 100;
         ++i) {  // a second more once there are many, at most 10
        most = std::max(most, open_descriptors());
        for (const auto& event : gate.wait(10ms)) EXPECT_NE(event.kind, Kind::lost);
        after += most > kDescriptors / 4;
    }
    // Half of what was free, and those that came before the door was closed: some milliseconds' on an idle machine.
    EXPECT_GT(most, kDescriptors / 4);
    EXPECT_LT(most, kDescriptors - 50);
    member.send(sim::OfferAnswer{0, 1, true}, 1);
    EXPECT_TRUE(wait_for(gate, Kind::message));
    // Who does not shake hands goes after 5 s, and who comes then gets in, after trying again.
    Peer late(gate.endpoint());
    late.send(sim::JoinRequest{{2}, "late"});
    EXPECT_TRUE(wait_for(gate, Kind::asks_to_join));
}

TEST(WorkerGate, ADismissedMemberIsAStrangerWhoIsToldSo) {
    sim::WorkerGate gate({"", {}, 60});
    Peer peer(gate.private_endpoint());
    join(gate, peer, 0);
    gate.dismiss(0);
    gate.send({0}, shared(sim::EndOfRun{}));  // to nobody
    // What comes before the gate's thread has done so is still a member's.
    bool refused = false;
    for (int i = 0; i < 200 && !refused; ++i) {
        peer.send(sim::OfferAnswer{1, 1, true}, 0);
        if (const auto message = peer.receive()) refused = std::holds_alternative<sim::Refusal>(*message);
    }
    EXPECT_TRUE(refused);
}

TEST(WorkerGate, WithKeysOnlyAListedKeyComesThrough) {
    const sim_test::KeyFolder keys({"worker"}), others({"worker"});
    sim::WorkerGate gate({"tcp://127.0.0.1:*", sim::read_application_keys(keys.path()), 60});
    Peer without(gate.endpoint());
    sim::WorkerKeys unlisted = sim::read_worker_keys(others.path() / "worker.key");
    unlisted.application = sim::read_application_keys(keys.path()).pair.shown;
    Peer wrong(gate.endpoint(), unlisted);
    Peer right(gate.endpoint(), sim::read_worker_keys(keys.path() / "worker.key"));
    without.send(sim::JoinRequest{{1}, "without"});
    wrong.send(sim::JoinRequest{{1}, "wrong"});
    for (int i = 0; i < 1000 && gate.refused_keys() == 0; ++i) std::this_thread::sleep_for(10ms);
    EXPECT_GT(gate.refused_keys(), 0u);
    right.send(sim::JoinRequest{{1}, "right"});
    const auto event = wait_for(gate, Kind::asks_to_join);
    ASSERT_TRUE(event);
    EXPECT_EQ(event->request.host, "right");
    EXPECT_FALSE(without.receive());
    EXPECT_FALSE(wrong.receive());
}

TEST(WorkerGate, AnEndpointOffLoopbackWithoutKeysAndOneThatIsTakenAreRefused) {
    EXPECT_THROW(sim::WorkerGate({"tcp://0.0.0.0:*", {}, 1}), std::invalid_argument);
    sim::WorkerGate first({"tcp://127.0.0.1:*", {}, 1});
    EXPECT_THROW(sim::WorkerGate({first.endpoint(), {}, 1}), std::invalid_argument);
}

}  // namespace
