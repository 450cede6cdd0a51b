#pragma once
#include "messages/worker_messages.h"
#include "workers/heartbeat.h"

namespace sim {

/// Runs a SharedWorldWorker behind a socket to the application. `threads` share out each of its steps. It
/// leaves in order when a signal asks for that (signals.h). Returns the exit status: 0 at the run's end or
/// after it has left, 1 if it was refused or the application is gone.
[[nodiscard]] int serve_world(zmq::socket_t& socket, Heartbeat& heartbeat, int threads,
                              const SceneMessage& scene);

}  // namespace sim
