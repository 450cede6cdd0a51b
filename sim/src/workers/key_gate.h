#pragma once
#include <atomic>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>
#include <zmq.hpp>

namespace sim {

/// Admits only peers with a listed key in CURVE's handshake (ZeroMQ's ZAP, RFC 27), on a thread of its own.
/// A context has one, constructed before its sockets are bound. The sockets need `kDomain`.
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
    [[nodiscard]] bool is_allowed(const Frames& request) const;
    void answer(const Frames& request);

    std::vector<std::string> allowed_;  ///< as bytes
    zmq::socket_t socket_;
    std::atomic<std::uint64_t> refused_ = 0;
    std::jthread thread_;  // last member: it starts after the others exist
};

}  // namespace sim
