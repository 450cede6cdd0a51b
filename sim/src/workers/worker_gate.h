#pragma once
#include <chrono>
#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>
#include <zmq.hpp>

#include "messages/worker_messages.h"
#include "workers/curve_keys.h"
#include "workers/key_gate.h"
#include "workers/listening.h"
#include "workers/socket_folder.h"

namespace sim {

/// The application's ROUTER socket on a thread of its own, so that heartbeats are answered and silence is
/// noticed while the application is busy. A peer is a stranger (known by its ROUTER identity) until it is
/// admitted under a worker's number. Strangers can only ask to join: other messages of a worker are answered
/// with a refusal, anything else is dropped and counted.
///
/// What peers may cost:
///   connections   as long as half of this process's descriptors, or 1000 more than at first, are open, `listen`
///                 takes no new connection; one that does not shake hands within 5 s is closed
///   joins         256 at once, then 4 a second; more are refused. Workers that are expected always may.
///   messages in   up to 4096, or 64 MiB and one more, wait for wait(); then the sockets hold back their senders
///                 (and heartbeats go out unasked).
///                 None is larger than `largest_message`; a stranger's of more than 4 KiB is dropped when ZeroMQ
///                 has received it whole.
///   messages out  a member for which more than `most_waiting` wait to be sent has its link broken
///   heartbeats    count for a member only with the secret with which it asked to join
class WorkerGate {
public:
    struct Settings {
        std::string listen;                        ///< tcp endpoint beside the private folder's; empty: none
        std::optional<ApplicationKeys> keys;       ///< for `listen`
        double silence_s = 1;                      ///< a worker that is silent for so long is lost
        bool in_folder = true;                     ///< listens in a private folder, too
        int most_waiting = 10'000;                 ///< messages to one member
        std::int64_t largest_message = 256 << 20;  ///< from a member [bytes]
    };
    /// Throws std::invalid_argument for an endpoint that is refused or taken.
    explicit WorkerGate(const Settings& settings);
    ~WorkerGate();  ///< waits at most a second for queued messages to go out

    [[nodiscard]] std::string private_endpoint() const {
        return folder_->endpoint();
    }                                                                        ///< ipc, in the folder
    [[nodiscard]] const std::string& endpoint() const { return endpoint_; }  ///< of `listen`, with its port

    struct Event {
        enum class Kind { asks_to_join, message, lost };
        Kind kind = Kind::message;
        std::string stranger;             ///< asks_to_join: identity
        JoinRequest request;              ///< asks_to_join
        std::uint32_t worker = 0;         ///< message, lost
        std::vector<std::uint8_t> bytes;  ///< message, as it came
        std::string why;                  ///< lost
    };
    /// Events that have arrived; waits for the first for at most `most`.
    [[nodiscard]] std::deque<Event> wait(std::chrono::milliseconds most);

    /// Requests to join with this secret are not refused for being too many.
    void expect(const Secret& secret);
    /// Makes it a member, whose heartbeats have that secret.
    void admit(const std::string& stranger, std::uint32_t worker, const Secret& secret);
    void refuse(const std::string& stranger, const std::string& why);  ///< answers its request
    void send(const std::vector<std::uint32_t>& workers,
              std::shared_ptr<const std::vector<std::uint8_t>> bytes);
    void dismiss(std::uint32_t worker);  ///< makes it a stranger again

    [[nodiscard]] std::uint64_t refused_messages() const noexcept { return refused_messages_; }  ///< dropped
    [[nodiscard]] std::uint64_t refused_keys() const noexcept { return keys_ ? keys_->refused() : 0; }

private:
    using Clock = std::chrono::steady_clock;
    using Bytes = std::shared_ptr<const std::vector<std::uint8_t>>;
    struct Member {
        std::string identity;
        Clock::time_point heard;
        bool lost = false;
        std::optional<Clock::time_point> broken = {};  ///< time since which sending to it fails
        Secret secret = {};                            ///< of its heartbeats
        std::string beats_from = {};                   ///< identity of the socket that they come from
    };
    struct Command {
        enum class Kind { admit, refuse, send, dismiss } kind;
        std::string stranger, why;
        std::vector<std::uint32_t> workers;
        Bytes bytes;
        Secret secret = {};
    };

    void bind(const Settings& settings);
    void open_door(const Settings& settings);
    void order(Command&& command);
    void serve(const std::stop_token& stop);
    void poll();
    void obey();
    void obey(const Command& command);
    void receive();
    void take(std::string&& identity, const zmq::message_t& frame);
    void take_beat(const std::string& identity, const zmq::message_t& frame);
    void take_from_stranger(std::string&& identity, const zmq::message_t& frame);
    bool send_to(const std::string& identity, zmq::message_t& frame);
    [[nodiscard]] bool may_join(const Secret& secret);
    void look_for_silence();
    void beat_unasked();
    void lose(std::uint32_t worker, Member& member, const std::string& why);
    void tell(Event&& event);

    const std::chrono::duration<double> silence_;
    std::optional<SocketFolder> folder_;
    zmq::context_t context_;
    std::unique_ptr<KeyGate> keys_;
    zmq::socket_t router_;
    std::string endpoint_;
    int wake_;  ///< eventfd: commands are there
    std::mutex mutex_;
    std::condition_variable came_;
    std::deque<Event> events_;       ///< under mutex_, as the next three
    std::size_t waiting_bytes_ = 0;  ///< in events_
    bool full_ = false;              ///< events_: nothing is received until they are taken
    std::vector<Secret> expected_;
    std::vector<Command> commands_;  ///< under mutex_
    std::atomic<std::uint64_t> refused_messages_ = 0;
    // The thread's own.
    std::map<std::uint32_t, Member> members_;
    std::map<std::string, std::uint32_t> numbers_;  ///< of identities
    Clock::time_point looked_ = Clock::now();
    bool held_back_ = false;                   ///< senders, since the last look
    Clock::time_point beaten_ = Clock::now();  ///< unasked
    double may_join_ = 0;                      ///< so many strangers now
    Clock::time_point counted_joins_ = Clock::now();
    std::optional<Listening> listening_;
    std::jthread thread_;  // last: starts when the rest is there
};

}  // namespace sim
