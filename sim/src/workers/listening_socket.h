#pragma once
#include <string>
#include <zmq.hpp>

namespace sim {

/// The TCP socket on which a ZeroMQ socket listens. ZeroMQ accepts every connection until this process has no
/// free descriptors, which would end the process. Before that, this class stops new connections; existing
/// ones stay. A filter in the kernel drops a new connection as a firewall does, so that its next attempt can
/// succeed. Without such filters in the kernel nothing is done.
class ListeningSocket {
public:
    /// Binds `socket`. Throws zmq::error_t.
    ListeningSocket(zmq::context_t& context, zmq::socket_t& socket, const std::string& endpoint);

    /// Stops or accepts new connections as descriptors become few or free. To be called often.
    void update() noexcept;

private:
    int descriptor_ = -1;  ///< ZeroMQ's own; -1: not known
    int most_ = 0;         ///< with fewer descriptors in use connections are accepted
    bool closed_ = false;
};

}  // namespace sim
