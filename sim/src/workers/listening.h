#pragma once
#include <string>
#include <zmq.hpp>

namespace sim {

/// The TCP socket on which a ZeroMQ socket listens. ZeroMQ accepts whoever connects, until this process has no
/// descriptors left, which ends it; this closes the door before, and the connections that are there stay. (A new one is dropped
/// by a filter in the kernel, as by a firewall, so that who tries again comes in later. Where the kernel has no
/// such filters, nothing is done.)
class Listening {
public:
    /// Binds `socket`. Throws zmq::error_t.
    Listening(zmq::context_t& context, zmq::socket_t& socket, const std::string& endpoint);

    /// Closes and opens the door as descriptors become few and free again: call it often.
    void look() noexcept;
    [[nodiscard]] bool closed() const noexcept { return closed_; }

private:
    int descriptor_ = -1;  ///< ZeroMQ's own; -1: not known
    int most_ = 0;         ///< descriptors open in this process, with which the door is open
    bool closed_ = false;
};

}  // namespace sim
