#pragma once
#include "messages/worker_messages.h"
#include "workers/heartbeat.h"

namespace sim {

/// By which a worker's process and the application are connected.
struct WorldLink {
    zmq::context_t& context;
    zmq::socket_t& socket;  ///< to the application, at `endpoint`
    Pulse& pulse;
    const std::string& endpoint;
    const std::optional<WorkerKeys>& keys;
    int threads;  ///< of a step
};

/// Serves a world: a SharedWorldWorker behind sockets; drains when asked to leave (leave_signals.h). Returns the exit status: 0 at the run's
/// end or when drained, 1 when refused or when the application is gone.
[[nodiscard]] int serve_world(const WorldLink& link, const SceneMessage& scene);

}  // namespace sim
