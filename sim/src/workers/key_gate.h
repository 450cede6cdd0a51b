#pragma once
#include <atomic>
#include <cstdint>
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

    KeyGate(zmq::context_t& context, const std::vector<std::string>& allowed);
    ~KeyGate();
    KeyGate(const KeyGate&) = delete;
    KeyGate& operator=(const KeyGate&) = delete;

    [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }  ///< handshakes

private:
    using Frames = std::vector<zmq::message_t>;
    void serve(const std::stop_token& stop);
    [[nodiscard]] bool knows(const Frames& request) const;
    void answer(const Frames& request);

    std::vector<std::string> allowed_;  ///< as bytes
    zmq::socket_t socket_;
    std::atomic<std::uint64_t> refused_ = 0;
    std::jthread thread_;  // last: starts when the rest is there
};

}  // namespace sim
