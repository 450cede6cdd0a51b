#pragma once
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>
#include <zmq.hpp>

#include "messages/worker_messages.h"
#include "workers/curve_keys.h"
#include "workers/key_gate.h"
#include "workers/listening.h"

namespace sim {

/// What one worker tells others directly, and hears from them. Each binds one socket, on which it hears from all (PULL), and
/// connects another to every one that the application has told it of (PUSH). A message has two frames: 16 bytes that only these
/// two and the application know, and a count of the messages on this link (u64, from 1); then the message itself.
///
/// A link serves while the other one says that it hears (LinkBeat), and was heard itself not long ago, or before a step that took
/// longer: so a worker that cannot be reached in one direction is told by way of the application. That is decided once a step, so
/// that what is told of a step comes one way, in order. Where a count is missed something is lost: in lockstep of the step in which
/// that shows no more is taken from this worker, but that it gave up; in bounded pace the messages tell it themselves.
///
/// Bad peers: a message without the right secret is dropped. Who sends what no worker tells another in this pace, messages of steps
/// that are over or after the last, or more of one step than steps need, is heard no more on this link, and has to tell by way of the
/// application.
/// No message is larger than `largest`; kMostPartsWaiting of each connection wait, then it is held back. Over TCP as many connections
/// are taken as Listening allows.
class PeerLinks {
public:
    using Clock = std::chrono::steady_clock;
    struct Settings {
        std::uint32_t self = 0;
        Pace pace = Pace::lockstep;
        std::string application;         ///< its endpoint
        std::optional<WorkerKeys> keys;  ///< of this worker; with them links are encrypted
        std::int64_t largest = 0;        ///< message [bytes]
        std::size_t most_parts = 0;      ///< messages that one worker tells of a step
        std::uint64_t steps = 0;         ///< of the run
    };
    /// Listens beside the application's socket in its private folder, or, over TCP, at the address by which this machine
    /// reaches the application. If it cannot, reach() is empty.
    PeerLinks(zmq::context_t& context, const Settings& settings);
    ~PeerLinks();
    PeerLinks(const PeerLinks&) = delete;
    PeerLinks& operator=(const PeerLinks&) = delete;

    [[nodiscard]] const std::optional<ReachMessage>& reach() const noexcept { return reach_; }
    void add(const PeersMessage& message);
    void keep(const std::vector<std::uint32_t>& members);  ///< forgets the others

    void look(Clock::time_point now);  ///< sends heartbeats if they are due; call it often
    void begin_step();                 ///< decides who is told directly in this step
    /// A step was not done together: who has not been heard for a while may be out of reach.
    void doubt(Clock::time_point now);
    /// Sends to those that are told directly; returns the others.
    [[nodiscard]] std::vector<std::uint32_t> send(const std::vector<std::uint32_t>& to,
                                                  const std::vector<std::uint8_t>& bytes);
    [[nodiscard]] std::optional<DecodedMessage> receive(Clock::time_point now);  ///< what one tells of a step
    /// It told what cannot be: it is heard no more.
    void close(std::uint32_t worker, const std::string& why);
    [[nodiscard]] void* handle() { return listens_.handle(); }  ///< to poll

    [[nodiscard]] bool is_up(std::uint32_t worker) const;
    [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }  ///< messages
    [[nodiscard]] std::uint64_t sent() const noexcept { return sent_; }  ///< bytes of parts, of every copy

private:
    struct Peer {
        zmq::socket_t socket;
        Secret says = {}, hears = {};
        std::uint64_t count_sent = 0, count_heard = 0;
        std::string key;
        std::optional<Clock::time_point> heard;  ///< last
        bool hears_this = false;                 ///< as it says
        bool direct = false;                     ///< in this step
        bool lost = false;                       ///< something of the step of its next part
        std::uint64_t step = 0, skip_until = 0;  ///< of its last part; steps below are not taken
        std::size_t parts = 0;                   ///< of that step
        bool closed = false;                     ///< it is bad
    };

    void bind(zmq::context_t& context);
    [[nodiscard]] bool may_connect(const PeersMessage::Peer& peer) const;
    void connect(const PeersMessage::Peer& peer);
    static bool send(Peer& peer, const zmq::message_t& message);
    void beat(Peer& peer);
    void take(const zmq::message_t& preamble, const zmq::message_t& message, Clock::time_point now);
    void read(std::uint32_t worker, Peer& peer, const zmq::message_t& message);
    [[nodiscard]] bool is_told(const WorkerMessage& message) const;
    void miss(std::uint32_t worker, Peer& peer, std::uint64_t step);

    Settings settings_;
    zmq::context_t& context_;
    std::unique_ptr<KeyGate> gate_;
    zmq::socket_t listens_;
    std::optional<Listening> listening_;
    std::optional<ReachMessage> reach_;
    std::map<std::uint32_t, Peer> peers_;
    std::map<Secret, std::uint32_t> who_says_;
    std::deque<DecodedMessage> heard_;
    Clock::time_point beaten_{};
    std::uint64_t refused_ = 0, sent_ = 0;
};

}  // namespace sim
