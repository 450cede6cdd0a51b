#pragma once
#include "messages/worker_messages.h"
#include "workers/heartbeat.h"

namespace sim {

/// Serves a world: a SharedWorldWorker behind a socket to the application; so many `threads` share out its steps. Drains
/// when asked to leave (leave_signals.h). Returns the exit status: 0 at the run's end or when drained, 1 when refused or
/// when the application is gone.
[[nodiscard]] int serve_world(zmq::socket_t& socket, Pulse& pulse, int threads, const SceneMessage& scene);

}  // namespace sim
