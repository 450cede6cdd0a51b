#pragma once
#include "workers/heartbeat.h"

namespace sim {

/// Serves a world: a SharedWorldWorker behind a socket. `first`: the application's answer to the request to
/// join. SIGTERM and SIGINT drain. Returns the exit status: 0 at the run's end or when drained, 1 when
/// refused or when the application is gone.
[[nodiscard]] int serve_world(zmq::socket_t& socket, Pulse& pulse, zmq::message_t& first);

/// The encoded JoinRequest, a worker's first message.
[[nodiscard]] std::vector<std::uint8_t> join_request(const Secret& secret);

}  // namespace sim
