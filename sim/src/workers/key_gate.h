#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <vector>
#include <zmq.hpp>

namespace sim {

/// Admits only peers with a listed key in CURVE's handshake (ZeroMQ's ZAP, RFC 27), on a thread of its own.
/// One per context, made before its sockets are bound; sockets need `kDomain`.
class KeyGate {
public:
    static constexpr const char* kDomain = "musicworld";

    /// patience: for so long a peer waits whose key may yet be allowed; then it is turned away and may try again.
    KeyGate(zmq::context_t& context, const std::vector<std::string>& allowed,
            std::chrono::milliseconds patience = {});
    ~KeyGate();
    KeyGate(const KeyGate&) = delete;
    KeyGate& operator=(const KeyGate&) = delete;

    void allow(const std::string& key);     ///< from now on, too; any thread
    void disallow(const std::string& key);  ///< takes one allow() of it back

    [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }  ///< handshakes

private:
    using Frames = std::vector<zmq::message_t>;
    struct Waiting {
        Frames request;
        std::chrono::steady_clock::time_point until;
    };
    void serve(const std::stop_token& stop);
    void take(Frames&& request);
    [[nodiscard]] bool knows(const Frames& request);
    void answer(const Frames& request, bool known);

    const std::chrono::milliseconds patience_;
    std::mutex mutex_;
    std::vector<std::string> allowed_;  ///< as bytes; under mutex_
    zmq::socket_t socket_;
    std::deque<Waiting> waiting_;  ///< by times
    std::atomic<std::uint64_t> refused_ = 0;
    std::jthread thread_;  // last: starts when the rest is there
};

}  // namespace sim
