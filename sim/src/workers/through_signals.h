#pragma once
#include <cerrno>
#include <zmq.hpp>

namespace sim {

/// A ZeroMQ call, again if a signal interrupts it.
template <typename Call>
auto through_signals(const Call& call) {
    for (;;) {
        try {
            return call();
        } catch (const zmq::error_t& e) {
            if (e.num() != EINTR) throw;
        }
    }
}

}  // namespace sim
