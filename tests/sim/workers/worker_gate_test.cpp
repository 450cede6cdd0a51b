#include "workers/worker_gate.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "key_folder.h"
#include "messages/struck_messages.h"
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
    void send(const sim::WorldMessage& message, std::uint32_t worker = 0) {
        send_bytes(sim::encode({worker, 0, 0}, message));
    }
    void send_bytes(const std::vector<std::uint8_t>& bytes, bool more = false) {
        (void)socket_.send(zmq::buffer(bytes), more ? zmq::send_flags::sndmore : zmq::send_flags::dontwait);
    }
    std::optional<sim::WorldMessage> receive() {
        zmq::message_t frame;
        if (!socket_.recv(frame)) return std::nullopt;
        return sim::decode_world({frame.data<std::uint8_t>(), frame.size()}).message;
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

void join(sim::WorkerGate& gate, Peer& peer, std::uint32_t worker) {
    peer.send(sim::JoinRequest{7, 42, "host"});
    const auto event = wait_for(gate, Kind::asks_to_join);
    ASSERT_TRUE(event);
    gate.admit(event->stranger, worker);
}

std::shared_ptr<const std::vector<std::uint8_t>> shared(const sim::WorldMessage& message) {
    return std::make_shared<const std::vector<std::uint8_t>>(sim::encode({}, message));
}

TEST(WorkerGate, AMemberIsHeardAndReachedByItsNumberAndOverTcpToo) {
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
    stranger.send(sim::Handover{1, 1, {}, {}, {}}, 0);
    EXPECT_TRUE(gets<sim::Refusal>(stranger));
    std::mt19937 rng(2);
    for (int i = 0; i < 300; ++i) {
        std::vector<std::uint8_t> noise(rng() % 300);
        for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(rng());
        stranger.send_bytes(noise, i % 3 == 0);
    }
    std::vector<std::uint8_t> forged = sim::encode({}, sim::JoinRequest{1, 2, "x"});
    forged[30] ^= 1;
    stranger.send_bytes(forged);
    stranger.send(sim::JoinRequest{9, 9, "the last"});
    const auto event = wait_for(gate, Kind::asks_to_join);
    ASSERT_TRUE(event);
    EXPECT_EQ(event->request.host, "the last");  // nothing before it came through
    EXPECT_GE(gate.refused_messages(), 200u);
    gate.send({0}, shared(sim::EndOfRun{}));
    EXPECT_TRUE(gets<sim::EndOfRun>(member));
}

TEST(WorkerGate, AKitsHelloIsLeftAloneSinceWorkersAskBothKindsOfApplication) {
    sim::WorkerGate gate({"", {}, 60});
    Peer peer(gate.private_endpoint());
    peer.send_bytes(sim::encode(sim::Hello{42}));
    join(gate, peer, 0);
    peer.send_bytes(sim::encode(sim::Hello{42}));
    peer.send(sim::Drained{});
    EXPECT_TRUE(wait_for(gate, Kind::message));
    EXPECT_EQ(gate.refused_messages(), 0u);
}

TEST(WorkerGate, HeartbeatsFromASocketOfTheirOwnKeepAMemberAndTheirEndLosesItOnce) {
    sim::WorkerGate gate({"", {}, 0.6});
    Peer quiet(gate.private_endpoint()), pulse(gate.private_endpoint());
    join(gate, quiet, 5);
    Peer other(gate.private_endpoint());
    join(gate, other, 6);  // never beats
    const auto beat = [&] { pulse.send(sim::WorldBeat{}, 5); };
    const auto lost = wait_for(gate, Kind::lost, beat);
    ASSERT_TRUE(lost);
    EXPECT_EQ(lost->worker, 6u);
    EXPECT_TRUE(gets<sim::WorldBeat>(pulse));  // answered
    const auto then = wait_for(gate, Kind::lost);
    ASSERT_TRUE(then);
    EXPECT_EQ(then->worker, 5u);
    for (const auto& event : gate.wait(100ms)) EXPECT_NE(event.kind, Kind::lost);
}

TEST(WorkerGate, ADismissedMemberIsAStrangerWhoIsToldSo) {
    sim::WorkerGate gate({"", {}, 60});
    Peer peer(gate.private_endpoint());
    join(gate, peer, 0);
    gate.dismiss(0);
    gate.send({0}, shared(sim::EndOfRun{}));  // to nobody
    peer.send(sim::OfferAnswer{1, 1, true}, 0);
    EXPECT_TRUE(gets<sim::Refusal>(peer));
}

TEST(WorkerGate, WithKeysOnlyAListedKeyComesThrough) {
    const sim_test::KeyFolder keys({"worker"}), others({"worker"});
    sim::WorkerGate gate({"tcp://127.0.0.1:*", sim::read_application_keys(keys.path()), 60});
    Peer without(gate.endpoint());
    sim::WorkerKeys unlisted = sim::read_worker_keys(others.path() / "worker.key");
    unlisted.application = sim::read_application_keys(keys.path()).pair.shown;
    Peer wrong(gate.endpoint(), unlisted);
    Peer right(gate.endpoint(), sim::read_worker_keys(keys.path() / "worker.key"));
    without.send(sim::JoinRequest{1, 1, "without"});
    wrong.send(sim::JoinRequest{1, 1, "wrong"});
    for (int i = 0; i < 1000 && gate.refused_keys() == 0; ++i) std::this_thread::sleep_for(10ms);
    EXPECT_GT(gate.refused_keys(), 0u);
    right.send(sim::JoinRequest{1, 1, "right"});
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
