#pragma once
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
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
#include "workers/listening_socket.h"
#include "workers/socket_folder.h"

namespace sim {

/// The application's ROUTER socket on a thread of its own, so that heartbeats are answered and silence is
/// noticed while the application is busy. A peer is a stranger, known by its ROUTER identity, until it is
/// admitted under a worker's number. A stranger can only ask to join. Other worker messages of a stranger are
/// answered with a refusal; anything else is dropped and counted.
///
/// Limits for peers:
///   connections   `listen` takes no new connection while half of this process's descriptors, or 1000 more
///                 than at first, are open. A connection without a handshake within 5 s is closed.
///   joins         256 at once, then 4 a second; more are refused. Expected workers are always admitted.
///   messages in   Up to 4096 messages, or 64 MiB and one message, wait for wait(). Then the sockets hold
///                 back their senders, and heartbeats are sent without a request. No message is larger than
///                 `largest_message`. A stranger's message of more than 4 KiB is dropped once ZeroMQ has
///                 received all of it.
///   messages out  A member for which more than `most_waiting` messages wait has its link broken.
///   heartbeats    A member's heartbeats count only with the secret with which it asked to join.
class WorkerGate {
public:
    struct Settings {
        std::string listen;                        ///< tcp endpoint, besides the private folder; empty: none
        std::optional<ApplicationKeys> keys;       ///< for `listen`
        double silence_s = 1;                      ///< a worker that is silent for this long is lost
        bool in_folder = true;                     ///< it also listens in a private folder
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
    /// Makes a stranger a member, whose heartbeats have that secret.
    void admit(const std::string& stranger, std::uint32_t worker, const Secret& secret);
    void refuse(const std::string& stranger, const std::string& why);  ///< answers a request to join
    void send(const std::vector<std::uint32_t>& workers,
              std::shared_ptr<const std::vector<std::uint8_t>> bytes);
    void dismiss(std::uint32_t worker);  ///< makes a member a stranger again

    [[nodiscard]] std::uint64_t refused_messages() const noexcept { return refused_messages_; }  ///< dropped
    [[nodiscard]] std::uint64_t refused_keys() const noexcept { return keys_ ? keys_->refused() : 0; }

private:
    using Clock = std::chrono::steady_clock;
    using Bytes = std::shared_ptr<const std::vector<std::uint8_t>>;
    struct Member {
        std::string identity;
        Clock::time_point received_at;  ///< the last message
        bool lost = false;
        std::optional<Clock::time_point> broken = {};  ///< time since which sending to it fails
        Secret secret = {};                            ///< of its heartbeats
        std::string beats_from = {};                   ///< identity of the socket that they come from
    };
    using Command = std::function<void()>;  ///< for the gate's thread

    void bind(const Settings& settings);
    void listen_at(const Settings& settings);
    void enqueue(Command&& command);
    void serve(const std::stop_token& stop);
    void poll();
    void execute_commands();
    void send_now(const std::vector<std::uint32_t>& workers, const std::vector<std::uint8_t>& bytes);
    void receive();
    void handle(std::string&& identity, const zmq::message_t& frame);
    void handle_beat(const std::string& identity, const zmq::message_t& frame);
    void handle_stranger(std::string&& identity, const zmq::message_t& frame);
    bool send_to(const std::string& identity, zmq::message_t& frame);
    [[nodiscard]] bool may_join(const Secret& secret);
    void check_silence();
    void send_unrequested_beats();
    void lose(std::uint32_t worker, Member& member, const std::string& why);
    void post(Event&& event);

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
    bool full_ = false;              ///< nothing is received until wait() takes events_
    std::vector<Secret> expected_;
    std::vector<Command> commands_;  ///< under mutex_
    std::atomic<std::uint64_t> refused_messages_ = 0;
    // The thread's own.
    std::map<std::uint32_t, Member> members_;
    std::map<std::string, std::uint32_t> numbers_;  ///< of identities
    Clock::time_point checked_ = Clock::now();      ///< for silence
    bool held_back_ = false;                        ///< senders were held back since the last check
    Clock::time_point sent_beats_ = Clock::now();   ///< without a request
    double may_join_ = 0;                           ///< strangers that may join now
    Clock::time_point counted_joins_ = Clock::now();
    std::optional<ListeningSocket> listening_;
    std::jthread thread_;  // last member: it starts after the others exist
};

}  // namespace sim
